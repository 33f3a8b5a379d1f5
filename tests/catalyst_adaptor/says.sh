#!/usr/bin/env bash
# says.sh PATTERN... -- COMMAND...: runs the command. Fails if the command fails, or if one of the patterns (grep -E)
# matches no line of its output.
set -uo pipefail
patterns=()
while [ "$1" != -- ]; do
  patterns+=("$1")
  shift
done
shift
said=$("$@" 2>&1)
status=$?
printf '%s\n' "$said"
for pattern in "${patterns[@]}"; do
  grep -qE -- "$pattern" <<<"$said" || { echo "nothing that it said matches: $pattern"; status=1; }
done
exit "$status"
