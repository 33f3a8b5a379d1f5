#include "vdi/runlog/Plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/core/Markup.h"

namespace vdi::runlog {

namespace {

constexpr double width = 1000.0;
constexpr double height = 560.0;
constexpr double left = 70.0;
constexpr double right = 980.0;
constexpr std::size_t mostHints = 2000;  // more would make a large file slow to show

/// Colours that colour-blind readers can tell apart, too (Okabe and Ito).
constexpr std::array<const char*, 8> palette{"#999999", "#0072B2", "#E69F00", "#56B4E9",
                                             "#009E73", "#CC79A7", "#F0E442", "#D55E00"};
constexpr const char* failure = "#c00000";

/// A round distance between ticks, for about `count` ticks up to `most`.
double tickDistance(double most, int count) {
  const double raw = most / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

/// A part of the picture with an axis of its own, which begins at 0.
struct Panel {
  double top = 0.0;
  double bottom = 0.0;
  double most = 1.0;

  double y(double value) const { return bottom - (bottom - top) * value / most; }
  std::string axis(const char* label) const {
    std::string out;
    constexpr int count = 5;
    const double distance = tickDistance(most, count);  // 0 if `most` is hardly above 0
    for (int i = 0; i <= count && i * distance <= most * (1.0 + 1e-9); ++i) {
      const double at = y(i * distance);
      out += fmt::format("<path class=\"grid\" d=\"M{} {:.1f}H{}\"/>\n", left, at, right);
      out += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>\n", left - 6.0,
                         at + 4.0, i * distance);
    }
    const double middle = 0.5 * (top + bottom);
    out += fmt::format(
        "<text transform=\"translate(18 {0:.1f}) rotate(-90)\" text-anchor=\"middle\">{1}</text>\n", middle,
        label);
    return out;
  }
};

class Picture {
 public:
  Picture(const RunRecords& records, const PlotOptions& options)
      : records_(records),
        options_(options),
        slot_((right - left) / static_cast<double>(records.frames.size())) {
    double mostMilliseconds = 0.0;
    double mostMebibytes = 0.0;
    for (const FrameRecord& frame : records.frames) {
      double sum = 0.0;
      for (const StageTime& stage : frame.stages) {
        sum += valueOf(stage);
        if (std::find(names_.begin(), names_.end(), stage.name) == names_.end()) names_.push_back(stage.name);
      }
      mostMilliseconds = std::max({mostMilliseconds, sum, frame.milliseconds});
      mostMebibytes = std::max(mostMebibytes, mebibytes(frame));
    }
    if (mostMilliseconds > 0.0) times_.most = mostMilliseconds;
    if (mostMebibytes > 0.0) bytes_.most = mostMebibytes;
  }

  std::string draw() const {
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n"
        "<style>.grid{{stroke:#ddd;fill:none}}.hint{{fill:#fff;fill-opacity:0}}"
        ".hint:hover{{fill:#000;fill-opacity:.08}}</style>\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
        width, height);
    out += head() + times_.axis("ms") + bytes_.axis("MiB written") + stages() + waits() + written() +
           failures() + steps() + hints();
    return out + "</svg>\n";
  }

 private:
  double valueOf(const StageTime& stage) const { return options_.means ? stage.mean : stage.slowest; }
  static double mebibytes(const FrameRecord& frame) {
    return static_cast<double>(frame.bytesWritten) / bytesPerMebibyte;
  }
  double x(std::size_t frame) const { return left + slot_ * static_cast<double>(frame); }
  double bar() const { return slot_ > 3.0 ? 0.85 * slot_ : slot_; }
  static const char* color(std::size_t stage) { return palette[stage % palette.size()]; }

  std::string head() const {
    RunSummary sum;
    for (const FrameRecord& frame : records_.frames) sum.add(frame);
    std::string what = escaped(options_.title);
    if (!records_.starts.empty()) {
      const RunStart& start = records_.starts.back();
      what += fmt::format("{}{}, {} rank{}", what.empty() ? "" : ": ", escaped(subjectOf(start)), start.ranks,
                          start.ranks == 1 ? "" : "s");
    }
    std::string out = fmt::format("<text x=\"{}\" y=\"22\" font-size=\"15\">{}</text>\n", left, what);
    const std::string leftOut =
        records_.leftOut.empty() ? "" : fmt::format("{} left out, ", records_.leftOut.size());
    out += fmt::format(
        "<text x=\"{}\" y=\"40\">{} frames made, {} failed, {}{} dropped by the stream; ms of the {} "
        "rank</text>\n",
        left, sum.frames, sum.failed, leftOut, sum.dropped, options_.means ? "mean" : "slowest");
    double at = left;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      out +=
          fmt::format("<rect x=\"{:.0f}\" y=\"50\" width=\"11\" height=\"11\" fill=\"{}\"/>", at, color(i));
      out += fmt::format("<text x=\"{:.0f}\" y=\"60\">{}</text>\n", at + 15.0, escaped(names_[i]));
      at += 36.0 + 7.0 * static_cast<double>(names_[i].size());
    }
    out += fmt::format("<path d=\"M{:.0f} 56h11\" stroke=\"#000\" stroke-width=\"1.5\"/>", at);
    const bool isIsolated = !records_.starts.empty() && records_.starts.back().isIsolated;
    return out + fmt::format("<text x=\"{:.0f}\" y=\"60\">{}</text>\n", at + 15.0,
                             isIsolated ? "the whole frame" : "the simulation's wait");
  }

  std::string stages() const {
    std::string out;
    std::vector<double> below(records_.frames.size(), 0.0);
    for (std::size_t i = 0; i < names_.size(); ++i) {
      std::string path;
      for (std::size_t f = 0; f < records_.frames.size(); ++f) {
        for (const StageTime& stage : records_.frames[f].stages) {
          if (stage.name == names_[i]) path += box(times_, f, below[f], valueOf(stage));
          if (stage.name == names_[i]) below[f] += valueOf(stage);
        }
      }
      out += fmt::format("<path class=\"stage\" fill=\"{}\" d=\"{}\"><title>{}</title></path>\n", color(i),
                         path, escaped(names_[i]));
    }
    return out;
  }
  std::string box(const Panel& panel, std::size_t frame, double from, double value) const {
    if (!(value > 0.0)) return {};
    return fmt::format("M{:.2f} {:.2f}h{:.2f}V{:.2f}h{:.2f}z", x(frame) + 0.5 * (slot_ - bar()),
                       panel.y(from), bar(), panel.y(from + value), -bar());
  }
  std::string waits() const {
    std::string path;
    for (std::size_t f = 0; f < records_.frames.size(); ++f)
      path += fmt::format("M{:.2f} {:.2f}h{:.2f}", x(f), times_.y(records_.frames[f].milliseconds), slot_);
    return fmt::format("<path class=\"wait\" d=\"{}\" stroke=\"#000\" stroke-width=\"1.5\" fill=\"none\"/>\n",
                       path);
  }
  std::string written() const {
    std::string path;
    for (std::size_t f = 0; f < records_.frames.size(); ++f)
      path += box(bytes_, f, 0.0, mebibytes(records_.frames[f]));
    return fmt::format("<path class=\"written\" fill=\"#555\" d=\"{}\"/>\n", path);
  }
  std::string failures() const {
    std::string path;
    for (std::size_t f = 0; f < records_.frames.size(); ++f) {
      if (!records_.frames[f].error.empty()) path += box(times_, f, 0.0, times_.most);
    }
    if (path.empty()) return {};
    return fmt::format("<path class=\"failed\" fill=\"{}\" fill-opacity=\".25\" d=\"{}\"/>\n", failure, path);
  }
  std::string steps() const {
    constexpr std::size_t mostLabels = 12;
    const std::size_t distance = (records_.frames.size() + mostLabels - 1) / mostLabels;
    std::string out;
    for (std::size_t f = 0; f < records_.frames.size(); f += distance) {
      out += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", x(f) + 0.5 * slot_,
                         bytes_.bottom + 18.0, records_.frames[f].step);
    }
    return out + fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">step</text>\n",
                             0.5 * (left + right), bytes_.bottom + 36.0);
  }
  std::string hints() const {
    std::string out;
    if (records_.frames.size() > mostHints) return out;
    for (std::size_t f = 0; f < records_.frames.size(); ++f) {
      out += fmt::format(
          "<rect class=\"hint\" x=\"{:.2f}\" y=\"{}\" width=\"{:.2f}\" "
          "height=\"{}\"><title>{}</title></rect>\n",
          x(f), times_.top, slot_, bytes_.bottom - times_.top, escaped(textLine(records_.frames[f])));
    }
    return out;
  }

  const RunRecords& records_;
  const PlotOptions& options_;
  double slot_;  // a frame's share of the width
  Panel times_{80.0, 380.0, 1.0};
  Panel bytes_{410.0, 510.0, 1.0};
  std::vector<std::string> names_;  // of the stages
};

}  // namespace

std::string plot(const RunRecords& records, const PlotOptions& options) {
  if (records.frames.empty()) throw Error(ErrorCode::Format, "the log has no frames to draw");
  return Picture(records, options).draw();
}

}  // namespace vdi::runlog
