#!/usr/bin/env bash
# Every script ends with code 2 on a wrong option, before it installs or builds anything, and with 0 on --help.
#   script_options_test.sh SOURCE_DIR
cd "$1" || exit 1
failed=0
expect() {  # expect CODE SCRIPT ARGUMENT...
  local code=$1 found
  shift
  timeout 20 "$@" >/dev/null 2>&1
  found=$?
  ((found == code)) || { echo "$*: ended with $found, must be $code"; failed=1; }
}
for script in scripts/{bench,check,quickstart,test} scripts/dev/{faults,fuzz,soak,tsan} testdata/make_testdata; do
  expect 0 "$script" --help
  [[ $script == scripts/test ]] || expect 2 "$script" --nonsense
done
expect 2 scripts/bench nonsense
expect 2 scripts/bench --rounds 0
expect 2 scripts/check --fix --nonsense
expect 2 scripts/dev/fuzz archive soon
expect 0 scripts/slurm/submit --help
expect 2 scripts/slurm/submit a.plan
expect 0 scripts/slurm/try --help
expect 2 scripts/slurm/try --nonsense
expect 2 scripts/quickstart --packages --nonsense
expect 2 scripts/test --golden nonsense
exit $failed
