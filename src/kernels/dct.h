#pragma once

#include <cstdint>
#include <vector>

namespace batchenc {

/// Signals that a Dct transforms at once.
inline constexpr std::int64_t kDctLanes = 16;

/// The orthonormal discrete cosine transform, type II, of one length, and its inverse (type III): with
/// alpha_0 = sqrt(1/n), else sqrt(2/n),
///
///   X_k = alpha_k sum_i x_i cos(pi k (2 i + 1) / (2 n))          (chapter 7, equation 7.3.5)
///
/// Any length, in O(n log n): over a complex Fourier transform of the same length (J. Makhoul, "A fast cosine
/// transform in one and two dimensions", 1980) that carries two signals, of mixed radices (Stockham's form);
/// lengths with large prime factors over one of twice the length (L. Bluestein, 1970). In float32 by + - * in
/// a fixed order, the same bits on every machine: factors come from kernels/steady_math and no products are
/// fused.
class Dct {
 public:
    /// length: 1 … 2^28. Tables take about 32 bytes a sample.
    explicit Dct(std::int64_t length);

    std::int64_t length() const { return length_; }
    /// Floats of workspace that forward and inverse want.
    std::int64_t workspace_size() const { return 2 * kDctLanes * work_length_; }

    /// In place. values: `length` rows of kDctLanes floats, a signal a lane. workspace: overwritten.
    void forward(float* values, float* workspace) const;
    void inverse(float* values, float* workspace) const;

    /// What the kernel reads; a complex number is two floats.
    struct Fourier {
        std::int64_t length = 1;
        std::vector<std::int32_t> radices;
        std::vector<float> roots;  ///< e^(-2 pi i t / length), t = 0 … length - 1
    };
    struct Tables {
        std::int64_t length;
        const Fourier* fourier;
        const float* turns;
        const float* chirp;   ///< null but for Bluestein's form
        const float* filter;  ///< likewise
    };

 private:
    Tables tables() const;

    std::int64_t length_;
    std::int64_t work_length_;   // of the Fourier transform that is computed
    Fourier fourier_;            // of work_length_
    std::vector<float> turns_;   // e^(-i pi k / 2n), scaled by alpha_k
    std::vector<float> chirp_;   // e^(-i pi k² / n); only where Bluestein's form is used
    std::vector<float> filter_;  // transform of its conjugate, over work_length_
};

}  // namespace batchenc
