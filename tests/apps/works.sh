#!/usr/bin/env bash
# Checks of commands. A test sources this file and ends with: exit $((failures > 0)). The output of the last command is
# in out.txt and err.txt.
failures=0

fail() {
  echo "FAILED  $*"
  failures=$((failures + 1))
}
# works <what> command...: exit status 0.
works() {
  local what=$1
  shift
  "$@" >out.txt 2>err.txt || { fail "$what: status $?"; cat out.txt err.txt; }
}
# says <pattern> command...: a line that the command writes to standard error.
says() {
  local pattern=$1
  shift
  grep -qiE "$pattern" err.txt || { fail "no '$pattern' in what is said of: $*"; cat err.txt; }
}
# refused <status> <pattern> command...: that exit status, and one line that matches.
refused() {
  local status=$1 pattern=$2
  shift 2
  "$@" >out.txt 2>err.txt
  local got=$?
  [ $got -eq "$status" ] || fail "status $got, not $status: $*"
  says "$pattern" "$@"
}
# fails <pattern> command...: any exit status but 0, and one line that matches.
fails() {
  local pattern=$1
  shift
  ! "$@" >out.txt 2>err.txt || fail "status 0: $*"
  says "$pattern" "$@"
}
