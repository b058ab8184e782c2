# What the scripts share; to be sourced. Leaves the shell in the checkout's root.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The compiler cache is used where it is installed.
configure_options=()
if command -v ccache > /dev/null; then configure_options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi

# The program alone, as build/release/apps/embrun.
build_program() {
  # Only a fresh build directory learns that there may be no GoogleTest here: test.sh turns the tests on.
  local tests=()
  if [ ! -f build/release/CMakeCache.txt ]; then tests=(-DEMBRUN_BUILD_TESTS=OFF -DEMBRUN_BUILD_BENCH=OFF); fi
  cmake --preset release "${tests[@]}" "${configure_options[@]}"
  cmake --build --preset release --target embrun_cli
}

step_names=()
step_seconds=()

# step NAME COMMAND...: runs the command and keeps how long it took.
step() {
  local name=$1 start=${EPOCHREALTIME/,/.}
  shift
  printf '\n== %s\n' "$name"
  "$@"
  step_names+=("$name")
  step_seconds+=("$(awk -v from="$start" -v to="${EPOCHREALTIME/,/.}" 'BEGIN { printf "%.1f", to - from }')")
}

# One line per step that ran.
report_steps() {
  local i
  echo
  for i in "${!step_names[@]}"; do printf '%8s s  %s\n' "${step_seconds[$i]}" "${step_names[$i]}"; done
}
