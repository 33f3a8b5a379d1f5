#include "vdi/core/Reconstruction.h"

#include "vdi/core/Error.h"

namespace vdi {

const char* toString(Reconstruction reconstruction) {
  switch (reconstruction) {
    case Reconstruction::Constant:
      return "constant";
    case Reconstruction::Smooth:
      return "smooth";
  }
  return "unknown";
}

Reconstruction reconstructionFromString(const std::string& name) {
  for (const Reconstruction known : {Reconstruction::Smooth, Reconstruction::Constant}) {
    if (name == toString(known)) return known;
  }
  throw Error(ErrorCode::InvalidArgument, "no reconstruction '" + name + "'; there are smooth and constant");
}

}  // namespace vdi
