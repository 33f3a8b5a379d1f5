#include "catalyst_adaptor/ParticleArray.h"

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "catalyst_adaptor/Calls.h"

namespace vdi::catalyst {

namespace {

/// `what` names the numbers in messages.
NumberColumn columnOf(const void* first, std::int64_t stride, std::int32_t type, std::int64_t count,
                      const char* what) {
  NumberColumn column;
  column.first = static_cast<const std::byte*>(first);
  column.stride = stride;
  column.isDouble = type == VDI_CATALYST_F64;
  if (type != VDI_CATALYST_F64 && type != VDI_CATALYST_F32)
    throw std::invalid_argument(std::string("particles' ") + what + " must be of type f32 or f64");
  std::int64_t reach = 0;
  const bool isCountable = !__builtin_mul_overflow(count - 1, stride, &reach);
  const auto address = reinterpret_cast<std::uintptr_t>(first);
  constexpr std::uintptr_t room = std::numeric_limits<std::uintptr_t>::max() - sizeof(double);
  const std::uintptr_t distance =
      reach < 0 ? 0 - static_cast<std::uintptr_t>(reach) : static_cast<std::uintptr_t>(reach);
  if (!isCountable || (reach < 0 ? distance > address : address > room || distance > room - address))
    throw std::invalid_argument(std::string("the stride of particles' ") + what +
                                " leads beyond the address space");
  return column;
}

}  // namespace

ParticleArray particleArrayOf(const vdi_catalyst_particles* given) {
  require(given != nullptr, "no particles given");
  require(given->count >= 0, "the number of particles can't be negative");
  require(given->kind == VDI_CATALYST_SUM || given->kind == VDI_CATALYST_DENSITY,
          "the kind of a particle array must be sum or density");
  ParticleArray array;
  array.kind = given->kind == VDI_CATALYST_DENSITY ? DepositKind::Density : DepositKind::Sum;
  array.particles.count = static_cast<std::size_t>(given->count);
  for (std::size_t axis = 0; axis < 3; ++axis) array.particles.periodic[axis] = given->periodic[axis] != 0;
  if (given->count == 0) return array;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    require(given->positions[axis] != nullptr, "particles without positions");
    array.particles.positions[axis] = columnOf(given->positions[axis], given->position_stride,
                                               given->position_type, given->count, "positions");
  }
  if (given->weights != nullptr)
    array.particles.weights =
        columnOf(given->weights, given->weight_stride, given->weight_type, given->count, "weights");
  if (given->lengths != nullptr)
    array.particles.lengths =
        columnOf(given->lengths, given->length_stride, given->length_type, given->count, "lengths");
  return array;
}

std::vector<NumberColumn*> columnsOf(Particles& particles) {
  std::vector<NumberColumn*> columns;
  for (NumberColumn* column : {&particles.positions[0], &particles.positions[1], &particles.positions[2],
                               &particles.weights, &particles.lengths}) {
    if (*column) columns.push_back(column);
  }
  return columns;
}

std::int64_t identityOf(const char* name, const ParticleArray& array) {
  const std::array<bool, 3>& periodic = array.particles.periodic;
  const std::size_t flags = (array.kind == DepositKind::Density ? 1U : 0U) | (periodic[0] ? 2U : 0U) |
                            (periodic[1] ? 4U : 0U) | (periodic[2] ? 8U : 0U);
  return static_cast<std::int64_t>(std::hash<std::string_view>()(name) ^ flags);
}

}  // namespace vdi::catalyst
