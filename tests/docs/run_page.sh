#!/usr/bin/env bash
# run_page.sh PAGE.md BIN_DIR SOURCE_DIR WORK_DIR [--write]: runs a page of the documentation as it is printed.
#   ```sh       every line is run
#   ```console  lines that begin with "$ " are run; what follows must be what they print, figures of time and memory aside
#   <!-- run: COMMAND -->   is run and not shown, to lay the files out that a page speaks of
# With --write the page gets what was printed, where that differs.
# All in one shell in WORK_DIR, which holds a copy of testdata/. The first command that fails ends the run.
set -euo pipefail
page=$1 bin=$2 source=$3 work=$4 write=${5-}
page_folder=$source/tests/docs  # of what pages need beyond testdata/
rm -rf "$work"
mkdir -p "$work"
cp -r "$source/testdata" "$work/testdata"
awk '
  function flush() {
    if (command == "") return
    gsub(/\x27/, "\x27\\\x27\x27", command)
    print "prints \x27" command "\x27 <<\x27END_OF_OUTPUT\x27"
    printf "%s", expected
    print "END_OF_OUTPUT"
    command = ""; expected = ""
  }
  /^<!-- run: .* -->$/ {sub(/^<!-- run: /, ""); sub(/ -->$/, ""); print; next}
  /^```sh$/ {kind = "sh"; next}
  /^```console$/ {kind = "console"; next}
  /^```/ {flush(); kind = ""; next}
  kind == "sh" {print}
  kind == "console" && /^\$ / {flush(); command = substr($0, 3); next}
  kind == "console" {expected = expected $0 "\n"}
' "$page" >"$work/page.commands"
[[ -s $work/page.commands ]] || { echo "$page: no command found" >&2; exit 1; }

# Times, rates and memory differ from run to run and machine to machine; a line of the page that is "..." stands for any lines.
masked() { sed -E 's/[0-9.]+ (ms|s|min|million|MB of memory)\b/N \1/g; s/^memory .*/memory/'; }
count=0
prints() {
  local expected printed actual
  expected=$(masked)
  printed=$(eval "$1" 2>&1)
  actual=$(masked <<<"$printed")
  count=$((count + 1))
  [[ $expected == *'...'* ]] && expected=${expected//'...'/'*'} || true
  # shellcheck disable=SC2053 # a pattern on purpose
  if [[ $actual == $expected ]]; then
    return
  elif [[ -n $write ]]; then
    cat <<<"$printed" >"$work/page.$count"
  else
    printf '%s\nshould print\n%s\nbut prints\n%s\n' "$1" "$expected" "$actual" >&2
    exit 1
  fi
}
export PATH=$bin:$PATH
cd "$work"
exec 9>&2
BASH_XTRACEFD=9  # not among what a command prints
set -x
source ./page.commands
set +x
cd "$source"
if [[ -n $write ]]; then
  awk -v work="$work" '
    /^```/ {is_console = /^```console$/; is_written = 0}
    is_console && /^\$ / {
      print
      is_written = 0
      file = work "/page." ++count
      while ((getline line <file) > 0) {print line; is_written = 1}
      next
    }
    !is_written {print}
  ' "$page" >"$work/page.md"
  cp "$work/page.md" "$page"
fi
rm -rf "$work"
