#include "VDIInput.h"

#include <vtkAlgorithm.h>
#include <vtkDataObject.h>
#include <vtkInformation.h>
#include <vtkMultiProcessController.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include "VDIBlocks.h"

namespace pv {

namespace {

/// The name and association of the filter's array, where they are set.
ArrayChoice choiceOf(vtkAlgorithm* filter) {
  ArrayChoice choice;
  if (vtkInformation* array = filter->GetInputArrayInformation(0)) {
    if (array->Has(vtkDataObject::FIELD_NAME())) choice.name = array->Get(vtkDataObject::FIELD_NAME());
    if (array->Has(vtkDataObject::FIELD_ASSOCIATION()))
      choice.cells = array->Get(vtkDataObject::FIELD_ASSOCIATION()) == vtkDataObject::FIELD_ASSOCIATION_CELLS;
  }
  return choice;
}

}  // namespace

void requestPiece(vtkInformation* info, vtkAlgorithm* filter, vtkMultiProcessController* controller) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  const int rank = controller != nullptr ? controller->GetLocalProcessId() : 0;
  const int ranks = controller != nullptr ? controller->GetNumberOfProcesses() : 1;
  // Cell data need a neighbour's cells to interpolate up to the common face. Both blocks have the points on
  // that face.
  const int ghosts = ranks > 1 && choiceOf(filter).cells ? 1 : 0;
  info->Set(Pipeline::UPDATE_PIECE_NUMBER(), rank);
  info->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), ranks);
  info->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), ghosts);
  // Asks for the whole extent. The source splits it and makes this rank's piece of it.
  if (info->Has(Pipeline::WHOLE_EXTENT())) {
    int whole[6];
    info->Get(Pipeline::WHOLE_EXTENT(), whole);
    info->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
  } else {
    info->Remove(Pipeline::UPDATE_EXTENT());  // the picture's, which composite sources would get
  }
}

Origin originOf(vtkDataObject* input, vtkAlgorithm* filter, int component, bool fillGhosts) {
  Origin origin;
  origin.choice = choiceOf(filter);
  origin.choice.component = component;
  origin.fillGhosts = fillGhosts;
  if (input != nullptr) {
    if (input->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
      origin.time = input->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
    origin.input = identityOf(input);
  }
  if (auto* upstream = vtkDemandDrivenPipeline::SafeDownCast(filter->GetInputExecutive(0, 0)))
    origin.upstream = upstream->GetPipelineMTime();
  return origin;
}

}  // namespace pv
