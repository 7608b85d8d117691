#!/usr/bin/env bash
# completion_test.sh COMPLETION_FILE FOLDER_OF_ISOHF: what TAB offers.
set -euo pipefail
PATH=$2:$PATH
source "$1"

offers() {  # offers EXPECTED WORD...: the words typed so far, the last one to be completed
  local expected=$1
  shift
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _isohf
  [[ " ${COMPREPLY[*]} " == *" $expected "* ]] || {
    echo "after '$*': '$expected' expected, offered: ${COMPREPLY[*]}" >&2
    exit 1
  }
}

offers convert isohf ''
offers convert isohf con
offers --version isohf --v
offers --overwrite isohf convert --over
offers --output isohf convert --o
offers --density isohf convert in.tif --
offers --against isohf verify --a
offers bspline3 isohf convert --filter bs
cd "$(dirname "$1")"
offers main.cpp isohf info main
