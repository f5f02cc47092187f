// Codes clips by other libraries and by coders of this project at equal error, and prints a row of CSV for
// each: every coder's one setting is searched for so that the error is just not above what is asked, all of
// it is decoded, and errors are measured on what was decoded. Behind docs/reproduction/external_peers.csv.
//
// Usage: batchenc_peers [--error kg=PERCENT]… [--max-error-relative BOUND]… [--only PEER]… CLIP.h5…
// Without errors, a clip known by name has those of docs/ANIMATION.md, another one kg = 0.5.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bench/peers/peer.h"
#include "io/source_clip.h"
#include "pipeline/blas_guard.h"
#include "pipeline/stopwatch.h"
#include "pipeline/threads.h"

namespace batchenc {
namespace {

constexpr double kClose = 0.995;  // of what is asked for: the search ends
constexpr int kMostRepairs = 5;
constexpr int kMostTrials = 24;     // of a search
constexpr double kShortTime = 1.0;  // s: what takes less is timed again, the shortest of three counts
const std::map<std::string, std::vector<double>> kUsualKg = {
    {"chicken", {0.35, 0.05}}, {"cowheavy", {0.65, 0.18}}, {"dance", {0.54, 0.065}}, {"samba", {0.53}}};

struct Options {
    std::vector<AskedError> errors;
    std::vector<std::string> peers;  // none: all
    std::vector<std::string> clips;
};

Expected<Options> read_options(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--only" && i + 1 < argc) {
            options.peers.emplace_back(argv[++i]);
            continue;
        }
        const bool is_kg = word == "--error";
        if (!is_kg && word != "--max-error-relative") {
            options.clips.push_back(word);
            continue;
        }
        std::string value = i + 1 < argc ? argv[++i] : "";
        if (is_kg) value = value.rfind("kg=", 0) == 0 ? value.substr(3) : "";
        const AskedError asked{is_kg, std::atof(value.c_str())};
        if (!(asked.value > 0.0)) return fail(ErrorCode::kInvalidArgument, word + " needs a positive value");
        options.errors.push_back(asked);
    }
    if (options.clips.empty()) return fail(ErrorCode::kInvalidArgument, "no clip named");
    return options;
}

std::vector<AskedError> errors_for(const std::string& path, const Options& options) {
    if (!options.errors.empty()) return options.errors;
    const auto usual = kUsualKg.find(std::filesystem::path(path).stem().string());
    if (usual == kUsualKg.end()) return {{true, 0.5}};
    std::vector<AskedError> errors;
    for (const double kg : usual->second) errors.push_back({true, kg});
    return errors;
}

ErrorMetrics metrics_of(const MeshSequence& clip, const std::vector<float>& decoded) {
    ErrorMeter meter(clip.vertex_count);
    meter.add(clip.view(), {decoded.data(), clip.frame_count, clip.vertex_count}, SerialExecutor());
    return meter.finish();
}

/// The coarsest setting found whose error is not above what is asked; by coding, or by approximation alone.
template <typename Measure>
Expected<double> search(const Peer::Range& range, double asked, Measure measure) {
    double good = range.finest, bad = range.coarsest;
    if (good == bad) return good;
    const auto first = measure(good);
    if (!first) return tl::unexpected(first.error());
    if (*first > asked) return fail(ErrorCode::kLimit, "even the finest setting is not fine enough");
    double good_error = *first;
    for (int trial = 0; trial < kMostTrials && good_error < kClose * asked; ++trial) {
        if (range.is_whole && bad - good <= 1.0) break;
        double next = range.is_whole ? std::floor(0.5 * (good + bad)) : std::sqrt(good * bad);
        // Errors mostly go with the setting: where that lands inside, it is tried first.
        if (!range.is_whole && good_error > 0.0) {
            const double guess = good * asked / good_error * 0.998;
            if (guess > good && guess < bad) next = guess;
        }
        const auto error = measure(next);
        if (!error) return tl::unexpected(error.error());
        if (*error <= asked) {
            good = next;
            good_error = *error;
        } else {
            bad = next;
        }
    }
    return good;
}

/// The shortest time of up to three runs; more than one only of short ones.
template <typename Work>
Expected<double> time_of(Work work) {
    double shortest = std::numeric_limits<double>::infinity(), sum = 0.0;
    for (int run = 0; run < 3 && sum < kShortTime; ++run) {
        const Stopwatch watch;
        if (auto done = work(); !done) return tl::unexpected(done.error());
        shortest = std::min(shortest, watch.seconds());
        sum += watch.seconds();
    }
    return shortest;
}

Expected<void> print_row(const std::string& clip_name, const MeshSequence& clip, const AskedError& asked,
                         Peer& peer) {
    std::vector<float> decoded;
    const auto by_approximation = [&](double setting) -> Expected<double> {
        if (auto done = peer.approximate(clip, setting, decoded); !done) return tl::unexpected(done.error());
        return asked.of(metrics_of(clip, decoded));
    };
    auto setting = search(peer.range(clip), asked.value, by_approximation);
    if (!setting) return tl::unexpected(setting.error());
    double encode_s = 0.0, decode_s = 0.0;
    ErrorMetrics metrics;
    for (int trial = 0;; ++trial) {  // an approximation may be a little off
        const auto encoding = time_of([&] { return peer.encode(clip, *setting); });
        if (!encoding) return tl::unexpected(encoding.error());
        decoded.clear();
        const auto decoding = time_of([&] { return peer.decode(decoded); });
        if (!decoding) return tl::unexpected(decoding.error());
        metrics = metrics_of(clip, decoded);
        encode_s = *encoding;
        decode_s = *decoding;
        const double error = asked.of(metrics);
        if (error <= asked.value || error > 1.1 * asked.value || trial == kMostRepairs) break;
        *setting *= 0.998 * asked.value / error;
    }
    if (!(asked.of(metrics) <= asked.value))
        return fail(ErrorCode::kNumerical, "decodes with an error of " + std::to_string(asked.of(metrics)) +
                                               " at " + peer.setting_text(*setting));
    const double megabytes = 4e-6 * static_cast<double>(clip.positions.size());
    const auto samples = static_cast<double>(clip.vertex_count * clip.frame_count);
    std::printf("%s,%s,\"%s\",%zu,%.4f,%.5f,%.5f,%.4g,%.2f,%.2f,%s=%.4g\n", clip_name.c_str(),
                peer.name().c_str(), peer.setting_text(*setting).c_str(), peer.size_bytes(),
                8.0 * static_cast<double>(peer.size_bytes()) / samples, metrics.da, metrics.kg,
                metrics.max_error_relative, megabytes / encode_s, megabytes / decode_s,
                asked.is_kg ? "kg" : "max_error_relative", asked.value);
    std::fflush(stdout);
    return {};
}

Expected<void> run(const Options& options) {
    std::printf(
        "clip,peer,setting,bytes,bpvf,da,kg,max_error_relative,encode_MB_per_s,decode_MB_per_s,asked\n");
    for (const std::string& path : options.clips) {
        const auto clip = read_mesh_sequence(path);
        if (!clip) return tl::unexpected(clip.error());
        const std::string name = std::filesystem::path(path).stem().string();
        for (const AskedError& asked : errors_for(path, options)) {
            Peers peers;
            add_own_peers(asked, peers);
            add_zstd_peers(peers);
#ifdef BATCHENC_HAS_BLOSC
            add_blosc_peers(peers);
#endif
#ifdef BATCHENC_HAS_MESHOPT
            add_meshopt_peers(peers);
#endif
#ifdef BATCHENC_HAS_ZFP
            add_zfp_peers(peers);
#endif
#ifdef BATCHENC_HAS_FPZIP
            add_fpzip_peers(peers);
#endif
#ifdef BATCHENC_HAS_DRACO
            add_draco_peers(peers);
#endif
            for (const auto& peer : peers) {
                const auto& only = options.peers;
                if (!only.empty() && std::find(only.begin(), only.end(), peer->name()) == only.end())
                    continue;
                if (auto done = print_row(name, *clip, asked, *peer); !done)
                    std::fprintf(stderr, "%s, %s left out: %s\n", name.c_str(), peer->name().c_str(),
                                 done.error().to_string().c_str());
            }
        }
    }
    return {};
}

}  // namespace

Expected<void> Peer::approximate(const MeshSequence& clip, double setting, std::vector<float>& decoded) {
    if (auto done = encode(clip, setting); !done) return done;
    return decode(decoded);
}

}  // namespace batchenc

int main(int argc, char** argv) {
    using namespace batchenc;
    const auto blas = guard_blas(argv);
    if (!blas) {
        std::fprintf(stderr, "%s\n", blas.error().to_string().c_str());
        return 1;
    }
    const auto options = read_options(argc, argv);
    Expected<void> done;
    if (options)
        run_with_threads(1, [&] { done = run(*options); });
    else
        done = tl::unexpected(options.error());
    if (done) return 0;
    std::fprintf(stderr, "%s\n", done.error().to_string().c_str());
    return 1;
}
