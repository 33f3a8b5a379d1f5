// The expected figures are those of scikit-image 0.19.3, from the same formulas in NumPy:
//   structural_similarity(a, b, channel_axis=2, gaussian_weights=True, sigma=1.5,
//                         use_sample_covariance=False, data_range=255)
//   peak_signal_noise_ratio(a, b, data_range=255)
// and NumPy's mean and max of the absolute differences. For the picture smaller than the window they use
// win_size=7, its own size, without Gaussian weights.
#include "tests/Catch.h"
#include "vdi/core/ImageMetrics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

using Pixels = std::vector<std::uint8_t>;

template <typename Formula>
Pixels fill(int width, int height, int channels, Formula formula) {
  Pixels pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) pixels.push_back(static_cast<std::uint8_t>(formula(x, y, c)));
    }
  }
  return pixels;
}

int wavy(int x, int y, int c) {
  return (x * x + 3 * y * y + 2 * x * y * (c + 1) + 40 * c) / 8 % 256;
}
int jittered(int x, int y, int c) {
  return std::clamp(wavy(x, y, c) + (5 * x + 3 * y + 7 * x * y + c) % 23 - 11, 0, 255);
}
int other(int x, int y, int c) {
  return (x * y * (c + 3) + 11 * x) / 4 % 256;
}
int shifted(int x, int y, int c) {
  return wavy(x + 2, y + 1, c);
}

struct Expected {
  int width;
  int height;
  int channels;
  int (*second)(int, int, int);
  double ssim;
  double psnrDb;
  double meanError;
  int maxError;
  int wrongPixels;
};

constexpr double tolerance = 1e-9;

}  // namespace

TEST_CASE("Figures equal scikit-image's") {
  const auto expected = GENERATE(
      Expected{33, 27, 3, jittered, 0.9758217949235579, 31.88926797177066, 5.542835765057987, 11, 0},
      Expected{48, 20, 1, other, 0.29874773766357327, 9.183139881271305, 67.97083333333333, 234, 781},
      Expected{40, 31, 3, shifted, 0.2004277227080268, 8.809434621434878, 70.18817204301075, 223, 1195},
      // one window exactly
      Expected{11, 11, 4, shifted, 0.8986730091816388, 22.178073833638507, 17.727272727272727, 45, 91},
      // smaller than the window
      Expected{7, 7, 3, jittered, 0.8152810246322059, 31.587531780738693, 5.836734693877551, 11, 0});
  CAPTURE(expected.width, expected.height, expected.channels);
  const Pixels a = fill(expected.width, expected.height, expected.channels, wavy);
  const Pixels b = fill(expected.width, expected.height, expected.channels, expected.second);
  const ImageDifference d = compare(a, b, expected.width, expected.height, expected.channels);
  CHECK(d.ssim == Approx(expected.ssim).margin(tolerance).epsilon(0.0));
  CHECK(d.psnrDb == Approx(expected.psnrDb).margin(tolerance).epsilon(0.0));
  CHECK(d.meanError == Approx(expected.meanError).margin(tolerance).epsilon(0.0));
  CHECK(d.maxError == expected.maxError);
  const double pixels = static_cast<double>(expected.width) * expected.height;
  CHECK(d.wrongShare == Approx(expected.wrongPixels / pixels).margin(tolerance).epsilon(0.0));
  const ImageDifference reverse = compare(b, a, expected.width, expected.height, expected.channels);
  CHECK(reverse.ssim == Approx(d.ssim).margin(tolerance).epsilon(0.0));
}

TEST_CASE("Equal pictures are perfect") {
  const int side = GENERATE(1, 2, 10, 11, 12, 30);
  const Pixels a = fill(side, side, 3, wavy);
  const ImageDifference d = compare(a, a, side, side, 3);
  CHECK(d.ssim == Approx(1.0).margin(tolerance));
  CHECK(std::isinf(d.psnrDb));
  CHECK(d.psnrDb > 0.0);
  CHECK(d.meanError == 0.0);
  CHECK(d.maxError == 0);
  CHECK(d.wrongShare == 0.0);
}

TEST_CASE("A pixel is wrong from 17 / 255 on, however many of its channels are") {
  Pixels a(4 * 4 * 3, 100);
  Pixels b = a;
  b[0] = 116;  // 16 off
  b[3] = 117;
  b[6] = b[7] = b[8] = 0;
  CHECK(compare(a, b, 4, 4, 3).wrongShare == 2.0 / 16.0);
}

TEST_CASE("An empty background doesn't hide what differs in the object") {
  constexpr int width = 60;
  constexpr int height = 40;
  // Expected: scikit-image's on the part of the pictures that has the object and 5 pixels around it.
  struct Place {
    int x;
    int y;
    double ssim;
  };
  const Place place = GENERATE(Place{25, 12, 0.3726988097238462}, Place{0, 0, 0.3126492543730688});
  const std::uint8_t background = 9;
  const auto objectOr = [&](int more) {
    return fill(width, height, 3, [=](int x, int y, int c) {
      const int u = x - place.x;
      const int v = y - place.y;
      const bool inside = u >= 0 && u < 20 && v >= 0 && v < 16;
      return inside ? (wavy(25 + u, 12 + v, c) + more) % 256 : background;
    });
  };
  const Pixels a = objectOr(0);
  const Pixels b = objectOr(40);
  const PictureBox box = objectBox(a, b, width, height, 3);
  CHECK(box.x == place.x);
  CHECK(box.y == place.y);
  CHECK(box.width == 20);
  CHECK(box.height == 16);
  CHECK(objectSsim(a, b, width, height, 3) == Approx(place.ssim).margin(tolerance).epsilon(0.0));
  CHECK(objectSsim(a, a, width, height, 3) == Approx(1.0).margin(tolerance));
  CHECK(compare(a, b, width, height, 3).ssim > 0.7);
  // Pictures whose backgrounds differ.
  const Pixels empty(a.size(), 200);
  CHECK(objectBox(a, empty, width, height, 3).width == 20);
  CHECK(objectBox(empty, Pixels(a.size(), 10), width, height, 3).width == 0);
  CHECK(objectSsim(empty, empty, width, height, 3) == 1.0);
}

TEST_CASE("Pictures of different sizes are refused") {
  const Pixels a(12 * 12, 1);
  const Pixels b(12 * 11, 1);
  CHECK_THROWS_AS(compare(a, b, 12, 12, 1), Error);
  CHECK_THROWS_AS(compare(a, a, 12, 11, 1), Error);
  CHECK_THROWS_AS(compare(Pixels{}, Pixels{}, 0, 0, 3), Error);
  CHECK_THROWS_AS(compare(a, a, -12, -12, 1), Error);
  CHECK_THROWS_AS(objectBox(a, b, 12, 12, 1), Error);
  CHECK_THROWS_AS(objectSsim(a, a, 12, 11, 1), Error);
}

}  // namespace vdi
