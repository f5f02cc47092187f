"""The coders as the thesis ran them, as settings beside those of rd_curves.CODERS, and names for pages and plots."""
from rd_runs import COLUMNS, each

MODE_COLUMNS = (*COLUMNS, "encode_time_s", "decode_time_s")
CLUSTERS, COMPONENTS = (10, 20, 30, 40), (2, 5, 10, 15, 20, 30, 40)
RLPCA = [{"codec.basis_bits": 12, "codec.coefficient_bits": 12, "codec.frame_bits": 16}]
KEEP = [{"codec.bits": bits, "codec.keep": keep} for bits, keeps in
        ((6, (0.02, 0.1, 0.5, 1)), (8, (0.02, 0.1, 0.5, 1)), (10, (0.02, 0.1, 0.5, 1)),
         (12, (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1))) for keep in keeps]
# Chapter 8's settings: clusters by clustering, 12 bits for basis and coefficients and 16 for frames; the spatial transform with a
# fixed share of coefficients; the predictor `time` in local frames at gates.
THESIS_MODES = {
    "rlpca-thesis": [each("codec.method", "rlpca"), each("segmentation.method", "clustering"),
                     each("segmentation.clusters", *CLUSTERS), each("codec.components", *COMPONENTS), RLPCA],
    "orlpca-thesis": [each("codec.method", "orlpca"), each("segmentation.method", "clustering"),
                      [{"segmentation.clusters": n, "codec.target.components": n * most} for n in CLUSTERS for most in COMPONENTS],
                      RLPCA],
    "pdct-thesis": [each("codec.method", "pdct"), each("codec.transform", "spatial"), each("codec.allocation", "fixed"),
                    each("segmentation.method", "clustering"), each("segmentation.clusters", 10, 20, 25, 40), KEEP],
    "splitcoder-thesis": [each("codec.method", "splitcoder"), each("codec.predictor", "time"), each("codec.bits", *range(5, 16))],
}
# Name in the tables: name on pages and plots, colour. Baselines stand for the thesis' TG, LPC and so on.
NAMES = {
    "rlpca-thesis": ("RLPCA", "#e69f00"), "orlpca-thesis": ("ORLPCA", "#cc79a7"), "pdct-thesis": ("PDCT", "#009e73"),
    "splitcoder-thesis": ("SplitCoder", "#0072b2"),
    "rlpca": ("RLPCA, best mode", "#e69f00"), "orlpca": ("ORLPCA, best mode", "#cc79a7"),
    "pdct": ("PDCT, best mode", "#009e73"), "splitcoder": ("SplitCoder, best mode", "#0072b2"), "rtpca": ("RTPCA", "#d55e00"),
    "baseline-static": ("TG", "#555555"), "baseline-lpc": ("LPC", "#56b4e9"), "baseline-pca": ("PCA", "#8b5a2b"),
    "baseline-pca-lpc": ("KG", "#7a3fa0"), "baseline-cpca": ("CPCA", "#d55e00"), "baseline-wavelet": ("wavelet", "#000000"),
    "baseline-dynapack": ("Dynapack", "#999999"), "baseline-angle": ("maverg+angle", "#b58b00"),
    "baseline-coddyac": ("CoDDyaC", "#c8553d"), "baseline-affine": ("affine", "#4a7c59"),
    "baseline-octree": ("octree", "#b0b0b0"),
}
STATE_OF_ART = ("baseline-static", "baseline-lpc", "baseline-pca-lpc", "baseline-pca", "baseline-cpca", "baseline-wavelet")


def name_of(coder):
    return NAMES[coder][0]


def is_dashed(coder):
    return coder.startswith("baseline-") or "best mode" in name_of(coder)
