#!/usr/bin/env bash
# 400 slow clients of each kind (headers, bodies, bodies that nobody reads, reading) on loopback: /healthz must answer under 100 ms at the median.
#   tests/soak/slow_clients.sh PROGRAM [SECONDS_EACH]
set -euo pipefail
. "$(dirname "$0")/server.sh"
program=$1 seconds=${2:-20} connections=400
start_server "$program"

# Milliseconds of /healthz, one line each, while the attack runs.
ask_health() {
  local end=$((SECONDS + seconds - 4))
  sleep 3   # until the connections are open
  while [ $SECONDS -lt $end ]; do
    curl -s -o /dev/null -w '%{http_code} %{time_total}\n' --max-time 5 "$url/healthz" || echo "000 5"
    sleep 0.1
  done
}

report() {
  local kind=$1
  awk -v kind="$kind" '$1 == 200 {print $2 * 1000} $1 != 200 {bad++} END {if (bad) print "bad " bad > "/dev/stderr"}' "$work/$kind.health" |
    sort -n >"$work/$kind.ms"
  local count median
  count=$(wc -l <"$work/$kind.ms")
  median=$(sed -n "$(((count + 1) / 2))p" "$work/$kind.ms")
  echo "$kind: $count answers of /healthz, median ${median:-none} ms, slowest $(tail -n 1 "$work/$kind.ms") ms"
  awk -v m="${median:-1000}" 'BEGIN {exit !(m < 100)}' || { echo "$kind: too slow"; failed=1; }
}

attack() {
  local kind=$1
  shift
  slowhttptest -c $connections -r 200 -l "$seconds" -p 3 "$@" >"$work/$kind.log" 2>&1 &
  local attacker=$!
  ask_health >"$work/$kind.health"
  wait $attacker || true
  report "$kind"
}

failed=0
attack headers -H -i 5 -u "$url/healthz"
attack body -B -i 5 -s 8192 -u "$url/v1/subjects"
attack unread -B -i 5 -s 60000 -u "$url/healthz"
attack read -X -w 10 -y 20 -n 5 -z 32 -k 3 -u "$url/openapi.json"
exit $failed
