# bash completion for isohf. Commands and options are read from the program's own --help; only the values of a few options
# are listed here.
_isohf() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]}
  local command='' i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    [[ ${COMP_WORDS[i]} == -* ]] || { command=${COMP_WORDS[i]}; break; }
  done
  COMPREPLY=()
  if [[ -z $command ]]; then
    local commands
    commands=$("$program" --help 2>/dev/null | sed -n '/^Commands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p')
    mapfile -t COMPREPLY < <(compgen -W "$commands help --help --version" -- "$current")
    return
  fi
  local help
  help=$("$program" "$command" --help 2>/dev/null)
  if [[ $current == -* ]]; then
    local options
    options=$(sed -n 's/^ \{2,6\}\(-[A-Za-z], \)\{0,1\}\(--[a-z][a-z0-9-]*\).*/\2/p' <<<"$help")
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
    return
  fi
  case $previous in
    --filter) mapfile -t COMPREPLY < <(compgen -W 'nearest bilinear catmull-rom bspline2 bspline3 bspline5 lanczos3 lanczos6' -- "$current") ;;
    --outside) mapfile -t COMPREPLY < <(compgen -W 'cover clamp void' -- "$current") ;;
    --type) mapfile -t COMPREPLY < <(compgen -W 'u16 u8 f32' -- "$current") ;;
    --registration) mapfile -t COMPREPLY < <(compgen -W 'area point auto' -- "$current") ;;
    --progress) mapfile -t COMPREPLY < <(compgen -W 'auto plain json none' -- "$current") ;;
    *) compopt -o filenames 2>/dev/null || true
       mapfile -t COMPREPLY < <(compgen -f -- "$current") ;;
  esac
}
complete -F _isohf isohf
