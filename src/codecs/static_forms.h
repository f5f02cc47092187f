#pragma once

#include <vector>

#include "core/parameters.h"
#include "kernels/static_prediction.h"

namespace batchenc {

/// Whether the bending angle comes from a surface that is fitted.
bool is_fitted(GeometryPredictor predictor);

/// The forms that a job's predictor stands for: of those with a curvature several. Of `auto` all but those
/// with a fitted surface.
std::vector<PredictionForm> forms_of(const CodecParameters& parameters);

/// Of `auto`: the forms with a fitted surface, on one tangential prediction. Where the job does not say what
/// surfaces are fitted to, the predictors' own and what was best on some kind of mesh: few vertices, many on
/// smooth surfaces, a quadric of many on machined ones.
std::vector<PredictionForm> surface_forms(const CodecParameters& parameters, TangentialPredictor tangential);

}  // namespace batchenc
