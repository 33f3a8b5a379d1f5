#include "vdi/core/ImageMetrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"

namespace vdi {

namespace {

constexpr int radius = 5;
constexpr double sigma = 1.5;
constexpr double c1 = (0.01 * 255.0) * (0.01 * 255.0);
constexpr double c2 = (0.03 * 255.0) * (0.03 * 255.0);

/// Moments of two windows.
struct Moments {
  double a = 0.0;
  double b = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  double ab = 0.0;

  void add(double weight, double x, double y) {
    a += weight * x;
    b += weight * y;
    aa += weight * x * x;
    bb += weight * y * y;
    ab += weight * x * y;
  }
  void add(double weight, const Moments& other) {
    a += weight * other.a;
    b += weight * other.b;
    aa += weight * other.aa;
    bb += weight * other.bb;
    ab += weight * other.ab;
  }
  double ssim() const {
    const double varianceA = aa - a * a;
    const double varianceB = bb - b * b;
    const double covariance = ab - a * b;
    return (2.0 * a * b + c1) * (2.0 * covariance + c2) /
           ((a * a + b * b + c1) * (varianceA + varianceB + c2));
  }
};

class Channel {
 public:
  Channel(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int channels,
          int channel)
      : a_(a), b_(b), width_(width), channels_(channels), channel_(channel) {}
  Moments at(int x, int y) const {
    const auto i =
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)) *
            static_cast<std::size_t>(channels_) +
        static_cast<std::size_t>(channel_);
    Moments m;
    m.add(1.0, a_[i], b_[i]);
    return m;
  }

 private:
  std::span<const std::uint8_t> a_;
  std::span<const std::uint8_t> b_;
  int width_;
  int channels_;
  int channel_;
};

double smallSsim(const Channel& channel, int width, int height) {
  Moments all;
  const double weight = 1.0 / (static_cast<double>(width) * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) all.add(weight, channel.at(x, y));
  }
  return all.ssim();
}

using Kernel = std::array<double, 2 * radius + 1>;

Kernel gaussian() {
  Kernel kernel{};
  double total = 0.0;
  for (std::size_t i = 0; i < kernel.size(); ++i) {
    const double distance = static_cast<double>(i) - radius;
    kernel[i] = std::exp(-0.5 * distance * distance / (sigma * sigma));
    total += kernel[i];
  }
  for (double& weight : kernel) weight /= total;
  return kernel;
}

/// Sum of SSIMs of one row of windows. The Gaussian is separable: columns first.
double rowOfSsims(const Channel& channel, const Kernel& kernel, int y, std::vector<Moments>& columns) {
  for (std::size_t x = 0; x < columns.size(); ++x) {
    Moments m;
    for (std::size_t i = 0; i < kernel.size(); ++i)
      m.add(kernel[i], channel.at(static_cast<int>(x), y - radius + static_cast<int>(i)));
    columns[x] = m;
  }
  double sum = 0.0;
  for (std::size_t first = 0; first + kernel.size() <= columns.size(); ++first) {
    Moments m;
    for (std::size_t i = 0; i < kernel.size(); ++i) m.add(kernel[i], columns[first + i]);
    sum += m.ssim();
  }
  return sum;
}

double windowedSsim(const Channel& channel, int width, int height) {
  const Kernel kernel = gaussian();
  std::vector<double> rows(static_cast<std::size_t>(height - 2 * radius));
  constexpr std::size_t rowsAtLeast = 4;
  inParallel(rows.size(), rowsAtLeast, [&](std::size_t first, std::size_t last) {
    std::vector<Moments> columns(static_cast<std::size_t>(width));
    for (std::size_t i = first; i < last; ++i)
      rows[i] = rowOfSsims(channel, kernel, static_cast<int>(i) + radius, columns);
  });
  const double sum = std::accumulate(rows.begin(), rows.end(), 0.0);  // independent of the number of threads
  return sum / (static_cast<double>(width - 2 * radius) * (height - 2 * radius));
}

double meanSsim(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height,
                int channels) {
  const bool small = width <= 2 * radius || height <= 2 * radius;
  double sum = 0.0;
  for (int c = 0; c < channels; ++c) {
    const Channel channel(a, b, width, channels, c);
    sum += small ? smallSsim(channel, width, height) : windowedSsim(channel, width, height);
  }
  return sum / channels;
}

/// Bytes of a picture of that size. Throws if the pictures have another size.
std::size_t requireOneSize(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width,
                           int height, int channels) {
  const auto expected =
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels);
  if (width < 1 || height < 1 || channels < 1 || a.size() != expected || b.size() != expected) {
    throw Error(ErrorCode::InvalidArgument, "the pictures aren't of one size");
  }
  return expected;
}

/// The pixels of one picture.
class Pixels {
 public:
  Pixels(std::span<const std::uint8_t> bytes, int width, int height, int channels)
      : bytes_(bytes), width_(width), height_(height), channels_(static_cast<std::size_t>(channels)) {}
  std::span<const std::uint8_t> at(int x, int y) const {
    const auto pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    return bytes_.subspan(pixel * channels_, channels_);
  }
  /// The most frequent pixel along the edge.
  std::vector<std::uint8_t> background() const {
    std::map<std::string, int> counts;  // by a pixel's bytes
    const auto count = [&](int x, int y) {
      const auto pixel = at(x, y);
      ++counts[std::string(pixel.begin(), pixel.end())];
    };
    for (int x = 0; x < width_; ++x) {
      count(x, 0);
      count(x, height_ - 1);
    }
    for (int y = 0; y < height_; ++y) {
      count(0, y);
      count(width_ - 1, y);
    }
    const auto most = std::max_element(counts.begin(), counts.end(), [](const auto& one, const auto& other) {
      return one.second < other.second;
    });
    return {most->first.begin(), most->first.end()};
  }
  bool differs(int x, int y, std::span<const std::uint8_t> from) const {
    constexpr int most = 2;
    const auto pixel = at(x, y);
    for (std::size_t c = 0; c < channels_; ++c) {
      if (std::abs(static_cast<int>(pixel[c]) - static_cast<int>(from[c])) > most) return true;
    }
    return false;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  int width_;
  int height_;
  std::size_t channels_;
};

std::vector<std::uint8_t> partOf(const Pixels& pixels, const PictureBox& box) {
  std::vector<std::uint8_t> part;
  for (int y = box.y; y < box.y + box.height; ++y) {
    for (int x = box.x; x < box.x + box.width; ++x) {
      const auto pixel = pixels.at(x, y);
      part.insert(part.end(), pixel.begin(), pixel.end());
    }
  }
  return part;
}

}  // namespace

PictureBox objectBox(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height,
                     int channels) {
  requireOneSize(a, b, width, height, channels);
  const std::array<Pixels, 2> pictures{Pixels(a, width, height, channels),
                                       Pixels(b, width, height, channels)};
  int left = width;
  int right = -1;
  int bottom = height;
  int top = -1;
  for (const Pixels& picture : pictures) {
    const std::vector<std::uint8_t> background = picture.background();
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (!picture.differs(x, y, background)) continue;
        left = std::min(left, x);
        right = std::max(right, x);
        bottom = std::min(bottom, y);
        top = std::max(top, y);
      }
    }
  }
  if (right < left) return {};
  return {left, bottom, right - left + 1, top - bottom + 1};
}

double objectSsim(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height,
                  int channels) {
  const PictureBox object = objectBox(a, b, width, height, channels);
  if (object.width == 0) return 1.0;
  PictureBox box;  // the object's box, extended by the windows' radius
  box.x = std::max(object.x - radius, 0);
  box.y = std::max(object.y - radius, 0);
  box.width = std::min(object.x + object.width + radius, width) - box.x;
  box.height = std::min(object.y + object.height + radius, height) - box.y;
  return meanSsim(partOf(Pixels(a, width, height, channels), box),
                  partOf(Pixels(b, width, height, channels), box), box.width, box.height, channels);
}

ImageDifference compare(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width,
                        int height, int channels) {
  const std::size_t expected = requireOneSize(a, b, width, height, channels);
  ImageDifference difference;
  double squares = 0.0;
  double absolute = 0.0;
  std::size_t wrong = 0;
  for (std::size_t pixel = 0; pixel < expected; pixel += static_cast<std::size_t>(channels)) {
    int worst = 0;
    for (std::size_t i = pixel; i < pixel + static_cast<std::size_t>(channels); ++i) {
      const int d = std::abs(static_cast<int>(a[i]) - static_cast<int>(b[i]));
      squares += static_cast<double>(d) * d;
      absolute += d;
      worst = std::max(worst, d);
    }
    difference.maxError = std::max(difference.maxError, worst);
    if (worst > 16) ++wrong;
  }
  const double mean = squares / static_cast<double>(expected);
  difference.psnrDb =
      mean > 0.0 ? 10.0 * std::log10(255.0 * 255.0 / mean) : std::numeric_limits<double>::infinity();
  difference.meanError = absolute / static_cast<double>(expected);
  difference.wrongShare = static_cast<double>(wrong) / (static_cast<double>(width) * height);
  difference.ssim = meanSsim(a, b, width, height, channels);
  return difference;
}

}  // namespace vdi
