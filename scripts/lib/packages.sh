# Sourced. The Debian 12 packages that isohf needs, and the one function that installs what is missing of them.

# Of the programs without viewer and modules, on whatever machine.
ISOHF_PACKAGES_LEAN=(
  zlib1g-dev libdeflate-dev libtiff-dev libpng-dev libjpeg-dev libpugixml-dev libwebp-dev libarchive-dev libgeotiff-dev
  libopenexr-dev libtbb-dev libfmt-dev nlohmann-json3-dev libcli11-dev libtomlplusplus-dev libgeographiclib-dev
  libproj-dev libnetcdf-dev nettle-dev libeigen3-dev)
ISOHF_PACKAGES_BUILD=(
  g++ cmake ninja-build pkg-config git ca-certificates
  "${ISOHF_PACKAGES_LEAN[@]}" libopenimageio-dev
  libepoxy-dev libglfw3-dev libegl-dev libgl-dev libegl1 libgl1-mesa-dri
  libgtest-dev libgmock-dev libbenchmark-dev
  unzip zip xvfb xauth xdotool python3-jsonschema)
ISOHF_PACKAGES_CHECK=(clang-format-14 clang-tidy-14)
ISOHF_PACKAGES_FUZZ=(clang-14 libclang-rt-14-dev)
ISOHF_PACKAGES_BENCH=(gdal-bin time python3 python3-numpy openimageio-tools)
ISOHF_PACKAGES_CLUSTER=(munge slurmctld slurmd slurm-client bc)

# isohf_require_packages NAME...: installs those that are missing; quick when none is.
isohf_require_packages() {
  local missing=() name as_root=()
  for name in "$@"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null) == installed ]] || missing+=("$name")
  done
  ((${#missing[@]})) || return 0
  if ! command -v apt-get >/dev/null; then
    echo "isohf: packages are missing and there is no apt-get here; install by hand: ${missing[*]}" >&2
    return 1
  fi
  if ((EUID != 0)); then
    command -v sudo >/dev/null || { echo "isohf: run as root once, or install: ${missing[*]}" >&2; return 1; }
    as_root=(sudo)
  fi
  echo "isohf: installing ${#missing[@]} Debian packages${as_root[0]:+ with sudo}: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}
