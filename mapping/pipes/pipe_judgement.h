// Whether what speaks for a pipe is enough.
#pragma once

#include "mapping/pipes/pipe_evidence.h"
#include "mapping/pipes/pipe_options.h"
#include "mapping/pipes/width_evidence.h"

namespace slcmap {

// Whether enough of the images show outlines on both sides, as of any pipe.
bool ShowsBothSides(const RayEvidence& rays);

// For thinner ones the cloud is too coarse.
inline constexpr double kLeastRadiusOfCloud_m = 0.035;

// Whether the cloud says so.
bool IsFlat(const Cylinder& cylinder, const SurfaceEvidence& surface);

// Whether lines are the outlines of a pipe, and of nothing else that is straight: the images tell
// it from fixed edges and the cloud does not speak against it, or the cloud is as round as it, or
// bulges between them, or it stands free.
bool IsPipe(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface,
            const PipeOptions& options);

// Whether images show it as wide as a pipe is and nothing else, and the cloud does not say that it
// is flat.
bool IsAsWideAsAPipe(const Cylinder& cylinder, const WidthEvidence& widths,
                     const SurfaceEvidence& surface);

}  // namespace slcmap
