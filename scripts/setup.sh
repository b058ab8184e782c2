#!/usr/bin/env bash
# Installs what Embrun's build needs from Debian's packages, as root or through sudo; asks nothing.
#   scripts/setup.sh [--tests] [--ci]
# --tests: also what the test suite and the benchmarks need, and OpenVDB, which writes density grids and which the build
# can do without (15.5 MB to download, 200 MB on the disk); --ci: also the tools of .ci/run.
# Where everything is there already it does nothing and needs no network.
set -euo pipefail

packages=(g++ cmake ninja-build libembree-dev libtbb-dev libopenexr-dev libpng-dev libjpeg-dev zlib1g-dev
          libcli11-dev libfmt-dev libspdlog-dev nlohmann-json3-dev libpugixml-dev)
test_packages=(libgtest-dev libbenchmark-dev libopenvdb-dev libboost-dev)
ci_packages=(ccache clang-14 libclang-rt-14-dev llvm-14 clang-format-14 clang-tidy-14)

for option in "$@"; do
  case $option in
    --tests) packages+=("${test_packages[@]}") ;;
    --ci) packages+=("${test_packages[@]}" "${ci_packages[@]}") ;;
    *) echo "setup.sh: unknown option $option (known: --tests --ci)" >&2; exit 2 ;;
  esac
done

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Abbrev}' "$package" 2>/dev/null || true)
  if [ "${status%% *}" != ii ]; then missing+=("$package"); fi
done
if [ ${#missing[@]} = 0 ]; then
  echo "setup: everything is installed"
  exit 0
fi

echo "setup: installing ${missing[*]}"
as_root=()
if [ "$(id -u)" != 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "setup.sh: not root, and there is no sudo; as root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=120)
"${apt[@]}" update
"${apt[@]}" install -y --no-install-recommends "${missing[@]}" > /dev/null
echo "setup: done"
