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
  local values=''
  case "$command $previous" in
    *' --filter') values='nearest bilinear catmull-rom bspline2 bspline3 bspline5 lanczos3 lanczos6' ;;
    *' --acquisition') values='point box tent gaussian: fir:' ;;
    *' --overlap') values='last first' ;;
    *' --outside') values='cover clamp void' ;;
    *' --type') values='u16 u8 f32' ;;
    *' --encoding') values='terrarium mapbox rgba-float' ;;
    *' --registration') values='area point auto' ;;
    *' --progress') values='auto plain json none' ;;
    *' --step') values='auto finest' ;;
    *' --method') values='hex barycentric' ;;
    *' --azimuth') values='E W' ;;
    *' --palette') values='elevation gray' ;;
    'experiment --fit') values='least-squares interpolate' ;;
    *' --texture-format') values='png jpeg' ;;
  esac
  if [[ -n $values ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current")
  else
    compopt -o filenames 2>/dev/null || true
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}
complete -F _isohf isohf
