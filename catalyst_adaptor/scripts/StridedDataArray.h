// Arrays of VTK on the simulation's memory, in the simulation's order.
#pragma once

#include <vtkDataArray.h>
#include <vtkGenericDataArray.h>
#include <vtkObjectFactory.h>
#include <vtkSmartPointer.h>
#include <vtkTypeTraits.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <glm/glm.hpp>
#include <limits>
#include <mutex>
#include <optional>
#include <span>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include "catalyst_adaptor/StridedArray.h"
#include "plugin/VolumetricDepthImages/StridedSource.h"

namespace vdi::catalyst {

/// VolumetricDepthImage reads the values where they are. So do ParaView's filters that ask for
/// values one by one. A filter that asks for a pointer gets one to a copy, which is made at its
/// first request after each Modified(), or to the values themselves if they are in order. The array
/// can't be written: VTK's filters get ordinary arrays from NewInstance.
template <typename T>
class StridedDataArray : public vtkGenericDataArray<StridedDataArray<T>, T>, public pv::StridedSource {
  using Self = StridedDataArray<T>;
  using Generic = vtkGenericDataArray<Self, T>;

 public:
  vtkAbstractTypeMacroWithNewInstanceType(Self, Generic, vtkDataArray, typeid(Self).name());
  static Self* New() { VTK_STANDARD_NEW_BODY(Self); }

  /// `values` must be reachable, and stay where they are while this object exists. `offset` is in cells.
  /// Floating-point values that equal one of `missing`, rounded to T, read as NaN.
  void set(const StridedValues& values, const glm::dvec3& offset, const std::vector<double>& missing) {
    values_ = values;
    offset_ = offset;
    missing_ = missing;
    this->SetNumberOfComponents(values.components);
    this->Size = static_cast<vtkIdType>(values.scalars());
    this->MaxId = this->Size - 1;
    this->Modified();
  }

  ComponentArray memory() const override {
    return {values_.first,           {values_.strides[0], values_.strides[1], values_.strides[2]},
            componentType(),         values_.components,
            values_.componentStride, missing_};
  }
  glm::ivec3 counts() const override { return {values_.counts[0], values_.counts[1], values_.counts[2]}; }
  glm::dvec3 offset() const override { return offset_; }

  T GetTypedComponent(vtkIdType tuple, int component) const {
    T value{};
    std::memcpy(&value, addressOf(tuple) + component * values_.componentStride, sizeof value);
    return unlessMissing(value);
  }
  T GetValue(vtkIdType index) const {
    return GetTypedComponent(index / values_.components, static_cast<int>(index % values_.components));
  }
  void GetTypedTuple(vtkIdType tuple, T* to) const {
    const std::byte* const from = addressOf(tuple);
    for (int c = 0; c < values_.components; ++c) {
      std::memcpy(to + c, from + c * values_.componentStride, sizeof(T));
      to[c] = unlessMissing(to[c]);
    }
  }
  void SetTypedComponent(vtkIdType, int, T) { refuse(); }
  void SetValue(vtkIdType, T) { refuse(); }
  void SetTypedTuple(vtkIdType, const T*) { refuse(); }

  void* GetVoidPointer(vtkIdType index) override {
    const auto bytes = static_cast<std::ptrdiff_t>(index) * static_cast<std::ptrdiff_t>(sizeof(T));
    // VTK's signature. Its filters only read through this pointer.
    const bool readAsTheyAre = missing_.empty() || !std::is_floating_point_v<T>;
    if (values_.inOrder() && readAsTheyAre) return const_cast<std::byte*>(values_.first) + bytes;
    const std::scoped_lock lock(copying_);
    if (!copy_) copy_.emplace(values_);
    if (copied_ < this->GetMTime()) {
      copy_->gather();
      if (!readAsTheyAre) {
        for (T& value : std::span(static_cast<T*>(copy_->data()), static_cast<std::size_t>(this->Size)))
          value = unlessMissing(value);
      }
      copied_ = this->GetMTime();
    }
    return static_cast<std::byte*>(copy_->data()) + bytes;
  }
  /// The copy's size in KiB, 0 without one: the values are the simulation's.
  unsigned long GetActualMemorySize() const override {
    const std::scoped_lock lock(copying_);
    return copy_ ? (static_cast<unsigned long>(this->Size) * sizeof(T) + 1023) / 1024 : 0;
  }

 protected:
  StridedDataArray() = default;
  vtkObjectBase* NewInstanceInternal() const override {
    return vtkDataArray::CreateDataArray(vtkTypeTraits<T>::VTK_TYPE_ID);
  }
  bool AllocateTuples(vtkIdType count) { return count == 0; }
  bool ReallocateTuples(vtkIdType count) { return count == this->GetNumberOfTuples(); }

 private:
  friend Generic;

  const std::byte* addressOf(vtkIdType tuple) const {
    const std::int64_t row = tuple / values_.counts[0];
    return values_.first + tuple % values_.counts[0] * values_.strides[0] +
           row % values_.counts[1] * values_.strides[1] + row / values_.counts[1] * values_.strides[2];
  }
  T unlessMissing(T value) const {
    if constexpr (std::is_floating_point_v<T>) {
      for (const double missing : missing_) {
        if (value == static_cast<T>(missing)) return std::numeric_limits<T>::quiet_NaN();
      }
    }
    return value;
  }
  static constexpr ComponentType componentType() {
    constexpr bool isInteger = std::is_integral_v<T>;
    constexpr bool isSigned = std::is_signed_v<T>;
    switch (sizeof(T)) {
      case 1:
        return isSigned ? ComponentType::I8 : ComponentType::U8;
      case 2:
        return isSigned ? ComponentType::I16 : ComponentType::U16;
      case 4:
        return !isInteger ? ComponentType::F32 : isSigned ? ComponentType::I32 : ComponentType::U32;
      default:
        return !isInteger ? ComponentType::F64 : isSigned ? ComponentType::I64 : ComponentType::U64;
    }
  }
  void refuse() { vtkErrorMacro("the simulation's array '" << this->GetName() << "' can only be read"); }

  StridedValues values_;
  glm::dvec3 offset_{0.0};
  std::vector<double> missing_;
  mutable std::mutex copying_;
  std::optional<StridedArray> copy_;
  vtkMTimeType copied_ = 0;
};

}  // namespace vdi::catalyst
