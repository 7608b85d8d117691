# Sourced, with $root set to the top of the tree. Configuring and building, the same way for every script.

# isohf_usage FIRST LAST: the lines of the calling script's head that say how it is called.
isohf_usage() { sed -n "$1,$2s/^# \{0,1\}//p" "$0"; }

# isohf_value ARGUMENT...: ends with code 2 where an option, the first, has no value behind it.
isohf_value() { (($# > 1)) || { echo "${0##*/}: $1 lacks its value" >&2; exit 2; }; }

# isohf_jobs: compilations side by side: one for each core, but no more than memory allows (about 1.5 GB for one).
isohf_jobs() {
  local cores memory_gb
  cores=$(nproc)
  memory_gb=$(awk '/MemAvailable/ {print int($2 / 1500000)}' /proc/meminfo)
  ((memory_gb < 1)) && memory_gb=1
  echo $((cores < memory_gb ? cores : memory_gb))
}

# isohf_folder PRESET: where it is built.
isohf_folder() { if [[ $1 == release ]]; then echo "$root/build"; else echo "$root/build-$1"; fi; }

# isohf_configure PRESET [-DNAME=VALUE...]: prints CMake's output only when something fails.
isohf_configure() {
  local preset=$1 folder log launcher=()
  shift
  folder=$(isohf_folder "$preset")
  mkdir -p "$folder"
  log=$folder/last_build.log
  [[ -f $folder/build.ninja ]] || ! command -v ccache >/dev/null ||
    launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON)
  (cd "$root" && cmake --preset "$preset" "${launcher[@]}" "$@") >"$log" 2>&1 || { cat "$log" >&2; return 1; }
}

# isohf_build PRESET [TARGET...]: configures once and builds; prints ninja's output only when something fails.
isohf_build() {
  local preset=$1 folder log
  shift
  folder=$(isohf_folder "$preset")
  log=$folder/last_build.log
  [[ -f $folder/build.ninja ]] || isohf_configure "$preset" || return 1
  [[ -f $folder/.ninja_log ]] || echo "isohf: building ${folder#"$root"/}; the first time takes some minutes" >&2
  local started=$SECONDS
  ninja -C "$folder" -j "$(isohf_jobs)" "$@" >"$log" 2>&1 || { cat "$log" >&2; return 1; }
  grep -q 'no work to do' "$log" || echo "isohf: built ${folder#"$root"/} in $((SECONDS - started)) s" >&2
}
