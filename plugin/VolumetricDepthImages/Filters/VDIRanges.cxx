#include "VDIRanges.h"

#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkInformation.h>
#include <vtkInformationDoubleVectorKey.h>
#include <vtkInformationInformationVectorKey.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedIntArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>

#include "vdi/core/Parallel.h"

namespace pv {

namespace {

/// The ranges of each component, and of the squares of the tuples' lengths.
template <typename T, std::size_t N>
struct Ranges {
  std::array<T, N> low;
  std::array<T, N> high;
  double lowSquare = std::numeric_limits<double>::max();
  double highSquare = 0.0;

  Ranges() {
    low.fill(std::numeric_limits<T>::max());
    high.fill(std::numeric_limits<T>::lowest());
  }

  void add(const T* values, std::size_t tuples) {
    for (std::size_t i = 0; i < tuples; ++i, values += N) {
      double square = 0.0;
      for (std::size_t c = 0; c < N; ++c) {
        low[c] = std::min(low[c], values[c]);
        high[c] = std::max(high[c], values[c]);
        square += static_cast<double>(values[c]) * static_cast<double>(values[c]);
      }
      lowSquare = std::min(lowSquare, square);
      highSquare = std::max(highSquare, square);
    }
  }

  void add(const Ranges& other) {
    for (std::size_t c = 0; c < N; ++c) {
      low[c] = std::min(low[c], other.low[c]);
      high[c] = std::max(high[c], other.high[c]);
    }
    lowSquare = std::min(lowSquare, other.lowSquare);
    highSquare = std::max(highSquare, other.highSquare);
  }
};

template <typename T, std::size_t N>
void remember(vtkDataArray* array, const T* values) {
  Ranges<T, N> all;
  std::mutex mutex;
  constexpr std::size_t minimum = 1U << 16;  // tuples
  vdi::inParallel(static_cast<std::size_t>(array->GetNumberOfTuples()), minimum,
                  [&](std::size_t first, std::size_t last) {
                    Ranges<T, N> own;
                    own.add(values + first * N, last - first);
                    const std::scoped_lock lock(mutex);
                    all.add(own);
                  });
  vtkNew<vtkInformationVector> components;
  components->SetNumberOfInformationObjects(static_cast<int>(N));
  for (std::size_t c = 0; c < N; ++c) {
    const double range[2] = {static_cast<double>(all.low[c]), static_cast<double>(all.high[c])};
    components->GetInformationObject(static_cast<int>(c))->Set(vtkDataArray::COMPONENT_RANGE(), range, 2);
  }
  const double lengths[2] = {std::sqrt(all.lowSquare), std::sqrt(all.highSquare)};
  vtkInformation* info = array->GetInformation();
  info->Set(vtkAbstractArray::PER_COMPONENT(), components);
  info->Set(vtkAbstractArray::PER_FINITE_COMPONENT(), components);
  info->Set(vtkDataArray::L2_NORM_RANGE(), lengths, 2);
  info->Set(vtkDataArray::L2_NORM_FINITE_RANGE(), lengths, 2);
}

}  // namespace

void rememberRanges(vtkDataArray* array) {
  if (array->GetNumberOfTuples() == 0) return;
  if (auto* bytes = vtkUnsignedCharArray::SafeDownCast(array)) {
    if (array->GetNumberOfComponents() == 4) remember<unsigned char, 4>(array, bytes->GetPointer(0));
  } else if (auto* words = vtkUnsignedIntArray::SafeDownCast(array)) {
    if (array->GetNumberOfComponents() == 1) remember<unsigned int, 1>(array, words->GetPointer(0));
    if (array->GetNumberOfComponents() == 2) remember<unsigned int, 2>(array, words->GetPointer(0));
  } else if (auto* floats = vtkFloatArray::SafeDownCast(array)) {
    if (array->GetNumberOfComponents() == 6) remember<float, 6>(array, floats->GetPointer(0));
  }
}

bool recallRanges(vtkDataArray* array, vtkInformationInformationVectorKey* components, double* ranges) {
  vtkInformationVector* stored = array->HasInformation() ? array->GetInformation()->Get(components) : nullptr;
  const int count = array->GetNumberOfComponents();
  if (stored == nullptr || stored->GetNumberOfInformationObjects() != count) return false;
  for (int c = 0; c < count; ++c) {
    vtkInformation* info = stored->GetInformationObject(c);
    if (!info->Has(vtkDataArray::COMPONENT_RANGE())) return false;
    info->Get(vtkDataArray::COMPONENT_RANGE(), ranges + 2 * std::ptrdiff_t{c});
  }
  return true;
}

bool recallRange(vtkDataArray* array, vtkInformationDoubleVectorKey* length, double range[2]) {
  if (!array->HasInformation() || !array->GetInformation()->Has(length)) return false;
  array->GetInformation()->Get(length, range);
  return true;
}

}  // namespace pv
