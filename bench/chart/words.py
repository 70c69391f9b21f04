"""What pages say about their charts and tables."""

PARETO = """
Time is sampling and filter: processor seconds over the number of threads, for wall time depends on what else the machine does.
Loading the scene and writing the file are left out. A line is a method at more and more samples; rings and the dotted line are
the front: what no other image beats in time and error; crosses: where a stop rule, or its cap of samples, ended. Dashed: what unfiltered uniform sampling would reach, whose MrSE falls
as 1 / time. The reference's own error is subtracted from MrSE, not from SSIM and FLIP."""

OVER_ALL = """
{front}. Each scene's time and error over those of the base, unfiltered uniform sampling at {anchor:g} samples a pixel, so that no
scene outweighs another; geometric means over the scenes."""

SPEEDUP = """
Time that a method needs for the default's error at {spp:g} samples a pixel, over the default's time: above 1 the default is
faster. ~: extrapolated by the last two points; <: its cheapest image is better already, so that it may need less; >: it does not
get there within 64 times its longest run. Means are over the scenes with a number."""

EQUAL_TIME = """
MrSE of the default over that of {rival} after the same time: below 1 the default is better. Between a method's points along
straight lines on log axes; after its last point its best; -: not finished by then."""

ERRORS = """
Means over the seeds. MrSE and RelMSE less the reference's own error; ~: below it, so that such numbers can't be told apart.
Energy: mean over the reference's; red: off by more than 1 %. Time: processor seconds over threads."""

PICTURES = """
At {spp:g} samples a pixel, first seed. Below each image its relative squared error, from 1e-4 (black) to 1 (yellow), on a log
scale."""

PARSIMONY = """
What the default took, from its reports. Uniform spp: samples a pixel that uniform sampling takes for the same MrSE with the same
filter (without a filter where that one was not run); marks as in Speed-up. Tried: candidates of auto on a part of the image. All
filters: each candidate with all features once on the whole image, by the seconds that auto measured on its part. Cost over all
on: what was taken over uniform spp and all filters; below 1 parsimony pays, tries and plans included."""

TABLES = """
At {spp:g} samples a pixel. The paper's figures print MrSE, SSIM and time inside pictures, for Sponza, Sibenik, San Miguel and
Teapot Room; of these only Sponza is here, and veach-ajar is of the same kind as the last. Time is sampling and filter, processor
seconds over threads."""

CONVERGENCE = """
The paper charts whole methods, so that what the sampler gains and what the filter gains can't be told apart. Left: filters on
the same uniform samples. Right: samplers without a filter, and methods with their own plan. Geometric means over the scenes,
each over its unfiltered error at {spp:g} samples."""

GRADIENT = """
MrSE of filters on the same uniform samples: what the gradient feature gives SBF, and the paper's filter in both readings beside
it."""

PASSES = """
The paper's Chess (512x385) takes {spp} samples a pixel after its passes. Samples go from a quarter of the mean (dark) to four
times the mean (yellow)."""

CLAIMS = """
What the paper says that can be tested, at {spp:g} samples a pixel. Its method runs in two readings, printed (to the letter) and
corrected (what we think was meant), sampler and filter; for the other methods the better of their own plan and uniform samples
counts."""
