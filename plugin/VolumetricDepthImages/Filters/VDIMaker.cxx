#include "VDIMaker.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>

#include <utility>

#include "VDIImageData.h"
#include "VDIOutput.h"
#include "VDISession.h"
#include "VDIVolume.h"
#include "vdi/pipeline/VdiGenerator.h"

namespace pv {

namespace {

/// Computes the ranges that ParaView asks for after an update. The arrays store them. It takes half a second
/// for a large VDI.
void findRanges(vtkFieldData* fields) {
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = fields->GetArray(i);
    if (array == nullptr) continue;
    const int components = array->GetNumberOfComponents();
    for (int component = components > 1 ? -1 : 0; component < components; ++component) {
      double range[2];
      array->GetRange(range, component);
      array->GetFiniteRange(range, component);
    }
  }
}

}  // namespace

Preparation::Make makerOf(FrameInputs frame, std::optional<Load> load, const Origin& origin, int step,
                          FrameReports& reports) {
  return [frame = std::move(frame), load = std::move(load), origin, step, &reports](
             Volume& volume, const vdi::Progress& progress, vtkVDIImageData* output) {
    volume.make();
    if (load) {
      volume.show(*load);
    } else {
      volume.requireShown(origin);
    }
    reports = {};
    vdi::VdiGenerator& generator = volume.generator();
    std::optional<vdi::Vdi> vdi = generator.generate(frame.camera, frame.function, frame.settings, progress);
    reports = reportsOf(generator);
    if (!vdi) return;  // another rank has it
    giveVdi(*vdi, *volume.shown(), origin, step, output);
    findRanges(output->GetPointData());
    findRanges(output->GetFieldData());
    if (isServer()) output->SetFile(fileOf(*vdi));
  };
}

}  // namespace pv
