#include "codecs/static_forms.h"

namespace batchenc {
namespace {

using enum GeometryPredictor;

PredictionForm bending_form(GeometryPredictor predictor, TangentialPredictor tangential,
                            const NormalFit& fit) {
    PredictionForm form;
    form.predictor = predictor;
    form.tangential = tangential;
    if (is_fitted(predictor)) form.fit = own_fit(fit, predictor);
    return form;
}

}  // namespace

bool is_fitted(GeometryPredictor predictor) { return bends(predictor) && predictor != kToumaGotsman; }

std::vector<PredictionForm> forms_of(const CodecParameters& parameters) {
    if (bends(parameters.predictor))
        return {bending_form(parameters.predictor, parameters.tangential, parameters.fit)};
    constexpr std::uint8_t kCurvatures[] = {0, 4, 8, 12};
    std::vector<PredictionForm> forms;
    for (const GeometryPredictor candidate :
         {kParallelogram, kMultiway, kLocalParallelogram, kLocalMultiway, kFitted, kWeighted}) {
        if (parameters.predictor != kAuto && parameters.predictor != candidate) continue;
        PredictionForm form;
        form.predictor = candidate;
        const bool curves = candidate >= kLocalParallelogram;
        for (const std::uint8_t curvature : kCurvatures) {
            form.curvature = curvature;
            forms.push_back(form);
            if (!curves) break;
        }
    }
    if (parameters.predictor != kAuto) return forms;
    for (const auto tangential : {TangentialPredictor::kFitted, TangentialPredictor::kWeighted,
                                  TangentialPredictor::kMultiway, TangentialPredictor::kParallelogram})
        forms.push_back(bending_form(kToumaGotsman, tangential, {}));
    return forms;
}

std::vector<PredictionForm> surface_forms(const CodecParameters& parameters, TangentialPredictor tangential) {
    std::vector<PredictionForm> forms;
    for (const GeometryPredictor predictor : {kHope, kHopi, kHops})
        forms.push_back(bending_form(predictor, tangential, parameters.fit));
    const NormalFit& fit = parameters.fit;
    if (fit.vertices > 0 || fit.exponent >= 0.0f || fit.cosine >= 0.0f) return forms;
    forms.push_back(bending_form(kHope, tangential, {18, 2.2f, 0.8f}));
    forms.push_back(bending_form(kHope, tangential, {64, 1.3f, 0.8f}));
    forms.push_back(bending_form(kHopi, tangential, {48, 2.2f, 0.95f}));
    return forms;
}

}  // namespace batchenc
