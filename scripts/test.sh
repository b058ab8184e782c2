#!/usr/bin/env bash
# The whole test suite: installs what is missing, builds Release, runs ctest.
#   scripts/test.sh [--all] [--werror]
# --all: also the tests labelled slow; --werror: warnings are errors. Asks nothing.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

labels=(--label-exclude slow)
configure_options+=(-DEMBRUN_BUILD_TESTS=ON -DEMBRUN_BUILD_BENCH=ON)
for option in "$@"; do
  case $option in
    --all) labels=() ;;
    --werror) configure_options+=(-DEMBRUN_WERROR=ON) ;;
    *) echo "test.sh: unknown option $option (known: --all --werror)" >&2; exit 2 ;;
  esac
done

step "packages" scripts/setup.sh --tests
step "configure" cmake --preset release "${configure_options[@]}"
step "build" cmake --build --preset release
step "tests" ctest --test-dir build/release --output-on-failure --parallel "$(nproc)" "${labels[@]}"
report_steps
