#!/usr/bin/env bash
# manual_test.sh PREFIX: what is installed there besides programs and library. Each command has a page of the manual with all
# of its options, pages are clean roff, and the shells complete commands, options and words. groff, zsh and fish may be missing.
set -euo pipefail
prefix=$1
share=$prefix/share
failures=0
fail() {
  echo "$*"
  failures=$((failures + 1))
}

source "$share/bash-completion/completions/isohf"
compopt() { :; }
complete_words() {  # complete_words WORD...: completions of the last one
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  COMPREPLY=()
  _isohf
  echo "${COMPREPLY[*]}"
}
expect() {  # expect COMPLETIONS WORD...
  local found
  found=$(complete_words "${@:2}")
  [[ $found == "$1" ]] || fail "'${*:2}' is completed by '$found', not '$1'"
}
commands=$(complete_words isohf '')
[[ $commands == "help plan convert info verify view sample shade export extract merge diff formats" ]] ||
  fail "commands: $commands"
expect convert isohf con
expect verify isohf --config settings.toml ver
expect --type isohf convert dem.tif --ty
expect 'u16 u8 f32' isohf convert dem.tif --type ''
expect 'u16 u8' isohf convert dem.tif --type = u
expect '--quiet' isohf info --qu
expect levels isohf view --mode lev
expect levels isohf-view --mode lev
cd "$share/man"
expect man1 isohf convert man
expect man1 isohf --config man

for command in '' ${commands#help}; do
  page=$share/man/man1/isohf${command:+-$command}.1
  [[ -x $prefix/bin/isohf-view || $command != view ]] || continue
  while read -r option; do
    grep -qF -- "${option//-/\\-}" "$page" "$share/man/man1/isohf.1" || fail "$page lacks $option"
  done < <("$prefix/bin/isohf" $command --help | grep -oE '^ {2,6}(-[a-zA-Z], )?--[a-z-]+' | grep -oE -- '--.*')
  [[ -z $(command -v groff) || -z $(groff -ww -man -Tutf8 -z "$page" 2>&1) ]] || fail "groff warns of $page"
done

[[ -z $(command -v zsh) ]] || zsh -n "$share/zsh/site-functions/_isohf" || fail "zsh does not read its completion"
if [[ -n $(command -v fish) ]]; then
  found=$(HOME=$share fish --no-config -c "source $share/fish/vendor_completions.d/isohf.fish; complete -C 'isohf convert --typ'" | cut -f1)
  [[ $found == --type ]] || fail "fish completes --typ by '$found'"
fi
exit $((failures > 0))
