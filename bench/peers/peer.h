#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/error_metrics.h"

namespace batchenc {

/// An error that all coders of a comparison keep to.
struct AskedError {
    bool is_kg = true;   ///< else the largest error over the diagonal
    double value = 0.0;  ///< kg: percent

    double of(const ErrorMetrics& metrics) const { return is_kg ? metrics.kg : metrics.max_error_relative; }
};

/// A coder of positions with one setting that trades bytes for error. It keeps what it coded last.
class Peer {
 public:
    virtual ~Peer() = default;
    virtual std::string name() const = 0;

    /// Settings to search in: the error does not fall from `finest` to `coarsest`. Of whole numbers, coded as
    /// such, where `is_whole`; else searched by ratios.
    struct Range {
        double finest, coarsest;
        bool is_whole = false;
    };
    virtual Range range(const MeshSequence& clip) const = 0;
    /// A setting's error by a shorter way than coding, where there is one; else by decoding what is coded.
    virtual Expected<void> approximate(const MeshSequence& clip, double setting, std::vector<float>& decoded);

    virtual Expected<void> encode(const MeshSequence& clip, double setting) = 0;
    /// positions: [F][V][3] of the clip that was coded.
    virtual Expected<void> decode(std::vector<float>& positions) = 0;
    virtual std::size_t size_bytes() const = 0;  ///< of what the decoder reads
    virtual std::string setting_text(double setting) const = 0;
};

using Peers = std::vector<std::unique_ptr<Peer>>;

void add_own_peers(const AskedError& asked, Peers& peers);
// Each adds a library's coders; those of libraries that the build did not find do not exist.
void add_zstd_peers(Peers& peers);
void add_blosc_peers(Peers& peers);
void add_meshopt_peers(Peers& peers);
void add_zfp_peers(Peers& peers);
void add_fpzip_peers(Peers& peers);
void add_draco_peers(Peers& peers);

}  // namespace batchenc
