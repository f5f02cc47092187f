#!/usr/bin/env bash
# Installs the Debian packages that building, testing and the demo need. Does nothing when all are there.
#
# Usage: scripts/install_dependencies.sh [FURTHER_PACKAGE...]
set -euo pipefail

packages=(
    g++ cmake ninja-build pkg-config
    libtbb-dev libopenblas-pthread-dev liblapacke-dev libeigen3-dev libhwy-dev
    libhdf5-dev libdeflate-dev libxxhash-dev libyaml-cpp-dev
    libcli11-dev libspdlog-dev libfmt-dev nlohmann-json3-dev libexpected-dev
    libgtest-dev libbenchmark-dev libzstd-dev
    python3 python3-numpy python3-h5py # the tests read results with a second reader
    "$@"
)

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian system. Install what these packages hold, then use cmake --preset release: ${packages[*]}" >&2
    exit 1
fi

missing=()
for package in "${packages[@]}"; do
    # dpkg-query fails for a package that it has never heard of, which counts as missing.
    status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null) || status=unknown
    [[ $status == installed ]] || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $EUID -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
        echo "Run this as root, or install sudo, to install: ${missing[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o DPkg::Lock::Timeout=600 "$@" >>"$log" 2>&1
}
echo "Installing ${#missing[@]} packages: ${missing[*]}"
if ! { apt update && apt --no-install-recommends install "${missing[@]}"; }; then
    cat "$log" >&2
    echo "Installing failed: ${missing[*]}" >&2
    exit 1
fi
