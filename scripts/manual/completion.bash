# bash completion for isohf and isohf-view.
declare -gA _isohf_options=() _isohf_words=()
_isohf_commands=help
_isohf_read() {
  local command names value words text
  while IFS=';' read -r command names value words text; do
    [[ -n $names ]] || _isohf_commands+=" $command"
    _isohf_options[$command]+=" $names"
    [[ -z $words ]] || _isohf_words["$command ${names##* }"]=$words
  done
}
_isohf_read <<'END'
@TABLE@
END
unset -f _isohf_read

_isohf() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command='' words i
  # "--type=u" is three words.
  if [[ $current == = ]]; then
    current=''
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    if [[ ${COMP_WORDS[i]} == --config ]]; then
      ((++i))
    elif [[ ${COMP_WORDS[i]} != -* && ${COMP_WORDS[i]} != help ]]; then
      command=${COMP_WORDS[i]}
      break
    fi
  done
  [[ ${COMP_WORDS[0]##*/} != isohf-view ]] || command=view
  words=${_isohf_words["$command $previous"]-}
  if [[ -z $words && $current == -* ]]; then
    words="${_isohf_options[all]} ${command:+${_isohf_options[$command]-}}"
  elif [[ -z $words$command && $previous != --config ]]; then
    words=$_isohf_commands
  fi
  if [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}
complete -F _isohf isohf isohf-view
