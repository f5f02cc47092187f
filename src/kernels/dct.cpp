#include "kernels/dct.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/dct.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

#include "kernels/steady_math.h"

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A row holds kDctLanes floats: real parts of eight complex lanes, then imaginary parts. A vector takes some
// of the eight; `lane` says from which on.
constexpr std::int64_t kRow = kDctLanes;
constexpr std::int64_t kImaginary = kDctLanes / 2;
constexpr std::int64_t kLargestRadix = 64;
using D = hn::CappedTag<float, static_cast<std::size_t>(kImaginary)>;
using Vector = hn::Vec<D>;

struct Complex {
    Vector re, im;
};

HWY_INLINE Complex load(const float* row) { return {hn::LoadU(D(), row), hn::LoadU(D(), row + kImaginary)}; }
HWY_INLINE void store(Complex z, float* row) {
    hn::StoreU(z.re, D(), row);
    hn::StoreU(z.im, D(), row + kImaginary);
}
HWY_INLINE Complex operator+(Complex a, Complex b) { return {hn::Add(a.re, b.re), hn::Add(a.im, b.im)}; }
HWY_INLINE Complex operator-(Complex a, Complex b) { return {hn::Sub(a.re, b.re), hn::Sub(a.im, b.im)}; }
HWY_INLINE Complex scaled(Complex a, float by) {
    const Vector factor = hn::Set(D(), by);
    return {hn::Mul(a.re, factor), hn::Mul(a.im, factor)};
}
/// a * -i
HWY_INLINE Complex turned(Complex a) { return {a.im, hn::Neg(a.re)}; }
HWY_INLINE Complex times(Complex a, float re, float im) {
    const Vector c = hn::Set(D(), re), s = hn::Set(D(), im);
    return {hn::Sub(hn::Mul(a.re, c), hn::Mul(a.im, s)), hn::Add(hn::Mul(a.re, s), hn::Mul(a.im, c))};
}

/// One butterfly of Stockham's form: `radix` inputs `in_step` floats apart, outputs `out_step` apart, the
/// l-th turned by the root number l * turn. kRadix: the radix, or 0 for one that is not known before.
template <int kRadix>
HWY_INLINE void butterfly(const Dct::Fourier& fourier, std::int64_t any_radix, const float* in,
                          std::int64_t in_step, float* out, std::int64_t out_step, std::int64_t turn) {
    const std::int64_t radix = kRadix > 0 ? kRadix : any_radix;
    const float* roots = fourier.roots.data();
    const auto put = [&](std::int64_t l, Complex z) {
        const std::int64_t root = l * turn;  // below the length
        store(root == 0 ? z : times(z, roots[2 * root], roots[2 * root + 1]), out + l * out_step);
    };
    if constexpr (kRadix == 2) {
        const Complex a = load(in), b = load(in + in_step);
        put(0, a + b);
        put(1, a - b);
    } else if constexpr (kRadix == 3) {
        constexpr float kHalfRoot = 0.8660254037844386f;
        const Complex a = load(in), b = load(in + in_step), c = load(in + 2 * in_step);
        const Complex sum = b + c, middle = a - scaled(sum, 0.5f);
        const Complex side = scaled(turned(b - c), kHalfRoot);
        put(0, a + sum);
        put(1, middle + side);
        put(2, middle - side);
    } else if constexpr (kRadix == 4) {
        const Complex a = load(in), b = load(in + in_step), c = load(in + 2 * in_step),
                      d = load(in + 3 * in_step);
        const Complex even = a + c, odd = a - c, other = b + d, side = turned(b - d);
        put(0, even + other);
        put(1, odd + side);
        put(2, even - other);
        put(3, odd - side);
    } else {  // odd: inputs k and radix - k have conjugate factors
        const std::int64_t pairs = (radix - 1) / 2;
        Complex sums[kLargestRadix / 2], differences[kLargestRadix / 2];
        const Complex first = load(in);
        Complex total = first;
        for (std::int64_t k = 1; k <= pairs; ++k) {
            const Complex a = load(in + k * in_step), b = load(in + (radix - k) * in_step);
            sums[k] = a + b;
            differences[k] = turned(a - b);
            total = total + sums[k];
        }
        put(0, total);
        const std::int64_t stride = fourier.length / radix;
        for (std::int64_t l = 1; l <= pairs; ++l) {
            Complex even = first, odd = {hn::Zero(D()), hn::Zero(D())};
            std::int64_t step = 0;
            for (std::int64_t k = 1; k <= pairs; ++k) {
                step += l;
                if (step >= radix) step -= radix;
                const float* root = roots + 2 * step * stride;
                even = even + scaled(sums[k], root[0]);
                odd = odd + scaled(differences[k], -root[1]);
            }
            put(l, even + odd);
            put(radix - l, even - odd);
        }
    }
}

/// One pass over all rows. done: rows that are transformed together before it; parts: how many remain after.
template <int kRadix>
void pass(const Dct::Fourier& fourier, std::int64_t radix, std::int64_t parts, std::int64_t done,
          const float* in, float* out) {
    for (std::int64_t j = 0; j < parts; ++j) {
        for (std::int64_t r = 0; r < done; ++r) {
            butterfly<kRadix>(fourier, radix, in + (r + done * j) * kRow, done * parts * kRow,
                              out + (r + done * radix * j) * kRow, done * kRow, j * done);
        }
    }
}

/// Fourier transform of `length` rows; in and out are overwritten, the result stands in the one returned.
float* transform(const Dct::Fourier& fourier, float* in, float* out) {
    std::int64_t rest = fourier.length, done = 1;
    for (const std::int32_t radix : fourier.radices) {
        const std::int64_t parts = rest / radix;
        switch (radix) {
            case 2:
                pass<2>(fourier, radix, parts, done, in, out);
                break;
            case 3:
                pass<3>(fourier, radix, parts, done, in, out);
                break;
            case 4:
                pass<4>(fourier, radix, parts, done, in, out);
                break;
            case 5:
                pass<5>(fourier, radix, parts, done, in, out);
                break;
            case 7:
                pass<7>(fourier, radix, parts, done, in, out);
                break;
            default:
                pass<0>(fourier, radix, parts, done, in, out);
                break;
        }
        rest = parts;
        done *= radix;
        std::swap(in, out);
    }
    return in;
}

/// The transform of `length` rows, where that is not what `fourier` has: as a convolution with a chirp.
float* transform_by_chirp(const Dct::Fourier& fourier, const float* chirp, const float* filter,
                          std::int64_t length, float* in, float* out) {
    for (std::int64_t k = 0; k < length; ++k)
        store(times(load(in + k * kRow), chirp[2 * k], chirp[2 * k + 1]), in + k * kRow);
    for (std::int64_t k = length; k < fourier.length; ++k)
        store({hn::Zero(D()), hn::Zero(D())}, in + k * kRow);
    float* spectrum = transform(fourier, in, out);
    float* other = spectrum == in ? out : in;
    // The way back is the conjugate of the transform of the conjugate.
    for (std::int64_t k = 0; k < fourier.length; ++k) {
        const Complex z = times(load(spectrum + k * kRow), filter[2 * k], filter[2 * k + 1]);
        store({z.re, hn::Neg(z.im)}, spectrum + k * kRow);
    }
    float* convolved = transform(fourier, spectrum, other);
    for (std::int64_t k = 0; k < length; ++k) {
        const Complex z = load(convolved + k * kRow);
        store(times({z.re, hn::Neg(z.im)}, chirp[2 * k], chirp[2 * k + 1]), convolved + k * kRow);
    }
    return convolved;
}

using Tables = Dct::Tables;

float* transform_any(const Tables& t, float* in, float* out) {
    return t.chirp == nullptr ? transform(*t.fourier, in, out)
                              : transform_by_chirp(*t.fourier, t.chirp, t.filter, t.length, in, out);
}

/// Signal a stands in the real parts, b in the imaginary parts; with Z the transform of a + i b reordered, A
/// = (Z_k + conj Z_-k) / 2 and i B = (Z_k - conj Z_-k) / 2, and the cosine transforms are the real parts of A
/// and B turned, at n - k the negative imaginary parts.
void forward(const Tables& t, float* values, float* workspace, std::int64_t lane) {
    const std::int64_t n = t.length, half = (n + 1) / 2;
    float* in = workspace + lane;
    float* out = in + t.fourier->length * kRow;
    values += lane;
    for (std::int64_t i = 0; i < half; ++i) store(load(values + 2 * i * kRow), in + i * kRow);
    for (std::int64_t i = half; i < n; ++i) store(load(values + (2 * (n - i) - 1) * kRow), in + i * kRow);
    const float* z = transform_any(t, in, out);
    store(scaled(load(z), t.turns[0]), values);
    for (std::int64_t k = 1; k <= n / 2; ++k) {
        const Complex p = load(z + k * kRow), q = load(z + (n - k) * kRow);
        const Complex a = {hn::Add(p.re, q.re), hn::Sub(p.im, q.im)};  // twice A
        const Complex b = {hn::Add(p.im, q.im), hn::Sub(q.re, p.re)};  // twice B
        const Complex x = times(a, t.turns[2 * k], t.turns[2 * k + 1]);
        const Complex y = times(b, t.turns[2 * k], t.turns[2 * k + 1]);
        store({x.re, y.re}, values + k * kRow);
        store({hn::Neg(x.im), hn::Neg(y.im)}, values + (n - k) * kRow);
    }
}

void inverse(const Tables& t, float* values, float* workspace, std::int64_t lane) {
    const std::int64_t n = t.length, half = (n + 1) / 2;
    float* in = workspace + lane;
    float* out = in + t.fourier->length * kRow;
    values += lane;
    // A = conj(turn) (X_k - i X_(n-k)), B alike; Z = A + i B at k and conj A + i conj B at n - k; what goes
    // in is conj Z.
    const Complex first = scaled(load(values), t.turns[0]);
    store({first.re, hn::Neg(first.im)}, in);
    for (std::int64_t k = 1; k <= n / 2; ++k) {
        const Complex p = load(values + k * kRow), q = load(values + (n - k) * kRow);
        const Complex a = times({p.re, hn::Neg(q.re)}, t.turns[2 * k], -t.turns[2 * k + 1]);
        const Complex b = times({p.im, hn::Neg(q.im)}, t.turns[2 * k], -t.turns[2 * k + 1]);
        store({hn::Sub(a.re, b.im), hn::Neg(hn::Add(a.im, b.re))}, in + k * kRow);
        store({hn::Add(a.re, b.im), hn::Sub(a.im, b.re)}, in + (n - k) * kRow);
    }
    const float* z = transform_any(t, in, out);
    for (std::int64_t i = 0; i < half; ++i) {
        const Complex w = load(z + i * kRow);
        store({w.re, hn::Neg(w.im)}, values + 2 * i * kRow);
    }
    for (std::int64_t i = half; i < n; ++i) {
        const Complex w = load(z + i * kRow);
        store({w.re, hn::Neg(w.im)}, values + (2 * (n - i) - 1) * kRow);
    }
}

void forward_all(const Tables& t, float* values, float* workspace) {
    for (std::int64_t lane = 0; lane < kImaginary; lane += static_cast<std::int64_t>(hn::Lanes(D())))
        forward(t, values, workspace, lane);
}

void inverse_all(const Tables& t, float* values, float* workspace) {
    for (std::int64_t lane = 0; lane < kImaginary; lane += static_cast<std::int64_t>(hn::Lanes(D())))
        inverse(t, values, workspace, lane);
}

void transform_all(const Dct::Fourier& fourier, float* values, float* workspace) {
    for (std::int64_t lane = 0; lane < kImaginary; lane += static_cast<std::int64_t>(hn::Lanes(D()))) {
        const float* z = transform(fourier, values + lane, workspace + lane);
        if (z == values + lane) continue;
        for (std::int64_t k = 0; k < fourier.length; ++k) store(load(z + k * kRow), values + lane + k * kRow);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {
namespace {

HWY_EXPORT(forward_all);
HWY_EXPORT(inverse_all);
HWY_EXPORT(transform_all);

/// Prime factors up to this are butterflies of their own.
constexpr std::int64_t kLargestPrime = 43;
constexpr double kPi = 3.14159265358979323846;

/// e^(-2 pi i part / whole), part in [0, whole).
std::pair<float, float> root_of_unity(std::int64_t part, std::int64_t whole) {
    const UnitVector u = unit_vector(2.0 * kPi * (static_cast<double>(part) / static_cast<double>(whole)));
    return {static_cast<float>(u.cosine), static_cast<float>(-u.sine)};
}

/// Radices of a length, ascending but for fours first; what is left of it when small primes are taken out.
std::int64_t split(std::int64_t length, std::vector<std::int32_t>& radices) {
    const auto take = [&](std::int64_t radix) {
        while (length % radix == 0) {
            radices.push_back(static_cast<std::int32_t>(radix));
            length /= radix;
        }
    };
    take(4);
    for (std::int64_t prime = 2; prime <= kLargestPrime; ++prime) take(prime);
    return length;
}

Dct::Fourier make_fourier(std::int64_t length) {
    Dct::Fourier fourier;
    fourier.length = length;
    split(length, fourier.radices);
    fourier.roots.resize(static_cast<std::size_t>(2 * length));
    for (std::int64_t t = 0; t < length; ++t) {
        const auto [re, im] = root_of_unity(t, length);
        fourier.roots[static_cast<std::size_t>(2 * t)] = re;
        fourier.roots[static_cast<std::size_t>(2 * t + 1)] = im;
    }
    return fourier;
}

/// The smallest length from `least` on without prime factors above 5.
std::int64_t smooth_length(std::int64_t least) {
    for (std::int64_t length = least;; ++length) {
        std::int64_t rest = length;
        for (const std::int64_t prime : {2, 3, 5})
            while (rest % prime == 0) rest /= prime;
        if (rest == 1) return length;
    }
}

}  // namespace

Dct::Dct(std::int64_t length) : length_(length), work_length_(length) {
    std::vector<std::int32_t> radices;
    const bool by_chirp = split(length, radices) != 1;
    if (by_chirp) work_length_ = smooth_length(2 * length - 1);
    fourier_ = make_fourier(work_length_);

    // alpha_k; half of it where a signal is taken from two places of the Fourier transform and the way back.
    const double root = std::sqrt(static_cast<double>(length));
    turns_.resize(static_cast<std::size_t>(length / 2 + 1) * 2);
    turns_[0] = static_cast<float>(1.0 / root);
    for (std::int64_t k = 1; k <= length / 2; ++k) {
        const auto [re, im] = root_of_unity(k, 4 * length);
        const float scale = static_cast<float>(std::sqrt(2.0) / root * 0.5);
        turns_[static_cast<std::size_t>(2 * k)] = re * scale;
        turns_[static_cast<std::size_t>(2 * k + 1)] = im * scale;
    }
    if (!by_chirp) return;
    chirp_.resize(static_cast<std::size_t>(2 * length));
    std::vector<float> rows(static_cast<std::size_t>(kDctLanes * work_length_), 0.0f);
    const float scale = static_cast<float>(1.0 / static_cast<double>(work_length_));
    for (std::int64_t k = 0; k < length; ++k) {
        const auto [re, im] = root_of_unity(k * k % (2 * length), 2 * length);
        chirp_[static_cast<std::size_t>(2 * k)] = re;
        chirp_[static_cast<std::size_t>(2 * k + 1)] = im;
        for (const std::int64_t place : {k, k == 0 ? k : work_length_ - k}) {
            rows[static_cast<std::size_t>(place * kDctLanes)] = re * scale;
            rows[static_cast<std::size_t>(place * kDctLanes + kDctLanes / 2)] = -im * scale;
        }
    }
    std::vector<float> workspace(rows.size());
    HWY_DYNAMIC_DISPATCH(transform_all)(fourier_, rows.data(), workspace.data());
    filter_.resize(static_cast<std::size_t>(2 * work_length_));
    for (std::int64_t k = 0; k < work_length_; ++k) {
        filter_[static_cast<std::size_t>(2 * k)] = rows[static_cast<std::size_t>(k * kDctLanes)];
        filter_[static_cast<std::size_t>(2 * k + 1)] =
            rows[static_cast<std::size_t>(k * kDctLanes + kDctLanes / 2)];
    }
}

Dct::Tables Dct::tables() const {
    return {length_, &fourier_, turns_.data(), chirp_.empty() ? nullptr : chirp_.data(), filter_.data()};
}

void Dct::forward(float* values, float* workspace) const {
    HWY_DYNAMIC_DISPATCH(forward_all)(tables(), values, workspace);
}

void Dct::inverse(float* values, float* workspace) const {
    HWY_DYNAMIC_DISPATCH(inverse_all)(tables(), values, workspace);
}

}  // namespace batchenc
#endif  // HWY_ONCE
