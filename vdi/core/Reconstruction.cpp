#include "vdi/core/Reconstruction.h"

#include "vdi/core/EnumNames.h"

namespace vdi {

namespace {

constexpr EnumNames<Reconstruction, 3> reconstructionNames{{{Reconstruction::Sheared, "sheared"},
                                                            {Reconstruction::Smooth, "smooth"},
                                                            {Reconstruction::Constant, "constant"}}};

}  // namespace

const char* toString(Reconstruction reconstruction) {
  return nameOf(reconstruction, reconstructionNames);
}

Reconstruction reconstructionFromString(const std::string& name) {
  return namedValue(name, "reconstruction", reconstructionNames);
}

}  // namespace vdi
