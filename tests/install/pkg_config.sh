#!/usr/bin/env bash
# Builds the programs of tests/install/project with only the compilers and pkg-config's flags, and runs two of them in
# a folder of their own. Arguments: the pkgconfig folder, the script, the output folder.
set -euo pipefail
project=$(dirname "$(realpath "$0")")/project
export PKG_CONFIG_PATH=$1
unset LD_LIBRARY_PATH # programs find the libraries by themselves
script=$2
rm -rf "$3" && mkdir -p "$3" && cd "$3"

read -ra catalyst <<<"$(pkg-config --cflags --libs pv-vdi-catalyst)"
read -ra library <<<"$(pkg-config --cflags --libs pv-vdi)"
mpicc "$project/simulation.c" -o from_c "${catalyst[@]}"
mpifort "$(pkg-config --variable=fortran_source pv-vdi-catalyst)" "$project/simulation.f90" -o from_fortran "${catalyst[@]}"
c++ -std=c++20 "$project/viewer.cpp" -o from_cpp "${library[@]}" "${catalyst[@]}"

./from_cpp from_cpp.vdi
VDI_OUTPUT=. xvfb-run -a ./from_fortran "$script"
test -s vdi_000001.vdi
