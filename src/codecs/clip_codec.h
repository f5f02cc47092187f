#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/segmentation.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "core/parameters.h"
#include "kernels/mesh_topology.h"

namespace batchenc {

/// Bytes of a clip's bitstream by what they are spent on; they sum to its size.
struct SectionBytes {
    std::int64_t headers = 0;  ///< magic, version, counts, section table, checksums
    std::int64_t segmentation = 0;
    std::int64_t frames = 0;
    std::int64_t basis = 0;
    std::int64_t coefficients = 0;
    std::int64_t residuals = 0;

    std::int64_t total() const { return headers + segmentation + frames + basis + coefficients + residuals; }
    SectionBytes& operator+=(const SectionBytes& other);
};

/// A coded clip: everything that its decoder needs besides the connectivity.
struct EncodedClip {
    std::vector<std::uint8_t> bitstream;
    SectionBytes section_bytes;
};

/// Codes a clip with the coder that parameters.method names.
///
/// positions: F x V, both at least 1, finite. mesh: of V vertices. segmentation: of this clip;
/// of coders without clusters (uses_clusters) anything. The bytes do not depend on the executor. Errors:
/// kInvalidArgument, kUnsupported (parameters), kNotFinite (frame and vertex named), kNumerical (LAPACK),
/// kLimit (coordinates, or what PDCT makes of them, beyond what the coder can hold).
Expected<EncodedClip> encode_clip(PositionsView positions, const MeshTopology& mesh,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor);
/// Likewise for the only clip of a mesh. triangles: every index below V.
Expected<EncodedClip> encode_clip(PositionsView positions, std::span<const Triangle> triangles,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor);

/// What a clip's bitstream says about itself; read without decoding it.
struct ClipInfo {
    CodecMethod method = CodecMethod::kRlpca;
    std::int64_t vertex_count = 0;
    std::int64_t frame_count = 0;
    std::int32_t cluster_count = 0;  ///< 0 where the coder has none
    std::int32_t component_count =
        0;                       ///< asked for; clusters of lower rank have fewer; 0 where there are none
    CodecParameters parameters;  ///< as coded
    SectionBytes section_bytes;
};

struct ClipBitstream;
/// Of any coder: method and counts, of the parameters the method alone.
ClipInfo basic_info(const ClipBitstream& clip);

/// Errors: kFormat (no clip bitstream), kUnsupported (version, method), kCorrupt (checksums, sizes).
Expected<ClipInfo> read_clip_info(std::span<const std::uint8_t> bitstream);

/// Whether a clip has frames [begin, begin + out.frame_count()) and out its V; else kOutOfRange. What every
/// DecodedClip asks before it reconstructs.
Expected<void> check_frames(const ClipInfo& info, std::int64_t begin, const MutablePositionsView& out);

/// A clip whose bitstream has been entropy-decoded, ready to give any frames.
class DecodedClip {
 public:
    virtual ~DecodedClip() = default;
    virtual const ClipInfo& info() const = 0;
    virtual const std::vector<std::int32_t>& labels() const = 0;  ///< V values; none without clusters

    /// Reconstructs frames [begin, begin + out.frame_count()) of the clip into out, which has the clip's V.
    /// Error: kOutOfRange when the clip does not have these frames or another number of vertices.
    virtual Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                                       const Executor& executor) const = 0;
};

/// Entropy-decodes a clip. components: use only the first so many (progressive decoding); negative for all.
/// size_limit_bytes bounds what is allocated, whatever the stream claims.
/// Errors: those of read_clip_info, and kLimit.
Expected<std::unique_ptr<DecodedClip>> decode_clip(std::span<const std::uint8_t> bitstream,
                                                   const SharedMesh& mesh, std::int32_t components,
                                                   std::int64_t size_limit_bytes, const Executor& executor);
/// Likewise for the only clip of a mesh. triangles: any; kCorrupt where one names a vertex that the clip does
/// not have.
Expected<std::unique_ptr<DecodedClip>> decode_clip(std::span<const std::uint8_t> bitstream,
                                                   std::span<const Triangle> triangles,
                                                   std::int32_t components, std::int64_t size_limit_bytes,
                                                   const Executor& executor);

}  // namespace batchenc
