#!/usr/bin/env bash
# Makes the .deb, checks its dependencies and files, and runs its tool from where it was unpacked. Arguments: the build
# folder, an output folder, the libraries' folder in the package, Python.
set -euo pipefail
build=$1
libraries=$3
python=$4
rm -rf "$2" && mkdir -p "$2" && cd "$2"
(cd "$build" && cpack -B "$OLDPWD" >"$OLDPWD/cpack.log" 2>&1) || { cat cpack.log; exit 1; }
depends=$(dpkg-deb -f pv-vdi_*.deb Depends)
# Open MPI's library has another number in each Debian.
for package in paraview python3-paraview 'libopenmpi[0-9]*' libvulkan1 'mesa-vulkan-drivers | vulkan-icd' libstdc++6; do
  [[ ", $depends," == *", "${package}[\ ,]* ]] || { echo "FAILED: it doesn't depend on $package, but on $depends"; exit 1; }
done
dpkg-deb -x pv-vdi_*.deb root
for file in usr/bin/{vdi,paraview.conf} usr/include/pv-vdi/vdi_catalyst.{h,f90} usr/share/doc/pv-vdi/copyright \
  "$libraries"/{libvdi_catalyst.so,libpv-vdi.so,pv-vdi/libvdi_catalyst_{engine,isolated,json}.so,pv-vdi/vdi_catalyst_process,pkgconfig/pv-vdi.pc} \
  "usr/bin/$(cat root/usr/bin/paraview.conf)"; do
  [ -e "root/$file" ] || { echo "FAILED: it has no $file"; exit 1; }
done
PYTHONPATH=root/usr/lib/python3/dist-packages "$python" -B -c "import pv_vdi.catalyst as c; c._load()" \
  || { echo "FAILED: its Python package can't be imported"; exit 1; }
if grep -rlF "$build" root; then
  echo "FAILED: the build folder's path is in these files"
  exit 1
fi
root/usr/bin/vdi --version
