# bash completion for isohf and isohf-view. Commands and options are read from the programs' own --help; only the values of
# a few options are listed here.
_isohf() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]}
  local command='' help i
  if [[ ${program##*/} == isohf-view ]]; then
    command=view
    help=$(NO_COLOR=1 "$program" --help 2>/dev/null)
  else
    for ((i = 1; i < COMP_CWORD; ++i)); do
      [[ ${COMP_WORDS[i]} == --config ]] && { ((++i)); continue; }
      [[ ${COMP_WORDS[i]} == -* || ${COMP_WORDS[i]} == help ]] || { command=${COMP_WORDS[i]}; break; }
    done
    help=$(NO_COLOR=1 "$program" $command --help 2>/dev/null)
  fi
  COMPREPLY=()
  if [[ -z $command && $current != -* && $previous != --config ]]; then
    local commands
    commands=$(sed -n '/^Commands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p' <<<"$help")
    mapfile -t COMPREPLY < <(compgen -W "$commands help" -- "$current")
    return
  fi
  if [[ $current == -* ]]; then
    local options
    options=$(sed -n 's/^ \{2,6\}\(-[A-Za-z], \)\{0,1\}\(--[a-z][a-z0-9-]*\).*/\2/p' <<<"$help")
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
    return
  fi
  local values=''
  case "$command $previous" in
    *' --filter') values='nearest bilinear limited-cubic bspline3' ;;
    *' --acquisition') values='point box gaussian:' ;;
    *' --overlap') values='last first' ;;
    *' --outside') values='cover clamp void' ;;
    'export --type') values='u8 u16 i16 u32 i32 f16 f32 f64' ;;
    *' --type') values='u16 u8 f32' ;;
    *' --encoding') values='terrarium mapbox rgba-float' ;;
    *' --registration') values='area point auto' ;;
    *' --progress') values='auto plain json none' ;;
    *' --step') values='auto finest' ;;
    *' --method') values='hex barycentric average' ;;
    *' --azimuth') values='E W' ;;
    *' --palette') values='elevation gray' ;;
    'view --mode') values='elevation levels strips texture normals' ;;
  esac
  if [[ -n $values ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current")
  else
    compopt -o filenames 2>/dev/null || true
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}
complete -F _isohf isohf isohf-view
