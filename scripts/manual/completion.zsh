#compdef isohf isohf-view

# _isohf_read COMMAND: appends its options to `options`, as _arguments reads them, and all commands to `commands`.
_isohf_read() {
  local command names value words text name
  while IFS=';' read -r command names value words text; do
    if [[ -z $names ]]; then
      commands+=("$command:$text")
    elif [[ $command == all || $command == $1 ]]; then
      text=${${text//\[/\\[}//\]/\\]}
      [[ -z $words ]] || words="($words)"
      for name in ${=names}; do
        if [[ -z $value ]]; then
          options+=("${name}[$text]")
        else
          [[ $name == --* ]] && name+== || name+=+
          options+=("${name}[$text]:${value//:/\\:}:${words:-_files}")
        fi
      done
    fi
  done <<'END'
@TABLE@
END
}

_isohf() {
  local curcontext=$curcontext state line
  local -a commands options
  if [[ $service == isohf-view ]]; then
    _isohf_read view
    _arguments -s $options '*:file:_files'
    return
  fi
  _isohf_read all
  _arguments -C -s $options '1:command:->command' '*::argument:->argument' && return
  if [[ $state == command ]]; then
    _describe command commands
  else
    options=()
    _isohf_read $line[1]
    _arguments -s $options '*:file:_files'
  fi
}
_isohf "$@"
