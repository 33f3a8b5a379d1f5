#include "vdi/pipeline/SurveyBuffer.h"

#include "shaders/shared/lists.h"

namespace vdi::detail {

static_assert(gpu::shared::surveyLevels == Survey::levels);

namespace {

constexpr std::uint64_t bytes = (Survey::levels + 1) * 2 * sizeof(std::uint32_t);

}  // namespace

SurveyBuffer::SurveyBuffer(std::shared_ptr<gpu::Device> device)
    : sums_(device, bytes, gpu::MemoryKind::DeviceLocal),
      readback_(std::move(device), bytes, gpu::MemoryKind::Readback) {}

Survey SurveyBuffer::take(gpu::Commands& commands, const Record& record) {
  commands.begin();
  commands.fill(sums_, 0);
  commands.barrier();
  commands.mark("survey");
  record(commands, sums_.address());
  commands.barrier();
  commands.mark("download");
  commands.copy(sums_, 0, readback_, 0, bytes);
  commands.submitAndWait();
  const auto words = readback_.mappedAs<std::uint32_t>();
  const auto sum = [&](std::size_t i) { return words[2 * i] | std::uint64_t{words[2 * i + 1]} << 32U; };
  Survey survey;
  for (std::size_t level = 0; level < Survey::levels; ++level) survey.supersegments[level] = sum(level);
  survey.equally = sum(Survey::levels);
  return survey;
}

}  // namespace vdi::detail
