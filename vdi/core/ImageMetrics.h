// Measures of the similarity of two pictures.
#pragma once

#include <cstdint>
#include <span>

namespace vdi {

struct ImageDifference {
  double ssim = 0.0;        // 1 = equal; mean over pixels and channels
  double psnrDb = 0.0;      // +infinity for equal pictures
  double meanError = 0.0;   // mean absolute difference, in 1/255
  int maxError = 0;         // largest absolute difference of a channel, in 1/255
  double wrongShare = 0.0;  // share of pixels with a channel off by more than 16/255
};

/// Compares 8-bit interleaved pictures [height][width][channels]. SSIM is Wang et al. 2004 with their
/// Gaussian window (sigma 1.5, 11 x 11), K1 = 0.01, K2 = 0.03, population covariance, without the 5 pixels at
/// the borders: the figures of scikit-image's structural_similarity(gaussian_weights=True, sigma=1.5,
/// use_sample_covariance=False, data_range=255). Pictures smaller than the window are compared with one
/// window of their own size and uniform weights. Throws Error{InvalidArgument} for pictures of different
/// sizes.
ImageDifference compare(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width,
                        int height, int channels);

/// A part of a picture: its corner with the lowest coordinates, and its size. Width 0: empty.
struct PictureBox {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// The bounding box of the objects in either picture: pixels with a channel off by more than 2/255 from the
/// most frequent colour along their own picture's edge. Takes the pictures of compare, and throws as it does.
PictureBox objectBox(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height,
                     int channels);

/// The SSIM of compare over the windows with their middle in objectBox, so that an empty background, equal in
/// all pictures, does not hide differences. 1 if there is no object.
double objectSsim(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height,
                  int channels);

}  // namespace vdi
