#!/usr/bin/env python3
"""The network of "Ours with CNN" as its paper prints it (Xing, Chen, Li 2020, section 3.4, Fig. 12): it says for each
pixel the parameters of the cross-bilateral filter of equations (7) to (9). server/denoise/net_printed*.cpp does the
same; what is said here of one is said of both.

The paper has 64 layers of 3x3 convolutions with 128 features and says nothing of inputs, data, or loss. Here: a plain
stack of --layers and --width (no residuals, so that about ten layers are the most that train), the inputs below, and
relative L1 of the filtered image.

    train/printed.py --data FOLDER/shards --seconds 90 --out relume_printed.tza
"""

import math

import torch
import torch.nn as nn
import torch.nn.functional as F

import crops

RADIUS = 8        # of the window, pixels
INPUTS = 16
# What the network starts from: the paper's constants, sigma_s 2 pixels.
START = {"s": 2.0, "r": 8.0, "n": 0.4, "a": 0.125, "d": 0.3}
LEAST_SIGMA, MOST_SIGMA = 0.01, 1e4
MOST_LOG, MOST_NOISE, MOST_COUNT = 16.0, 4.0, 2.0
CUT = 80.0        # exponents beyond are weight 0
LEAST_VARIANCE = 1e-10


def gradient(color):
    """Magnitude of the Sobel gradient of the grey image, replicated at the border: (10), (11)."""
    grey = F.pad(color.mean(1, keepdim=True), (1,) * 4, mode="replicate")
    across = torch.tensor([[-1.0, 0, 1], [-2, 0, 2], [-1, 0, 1]], device=color.device)
    kernels = torch.stack([across, across.t()])[:, None]
    return F.conv2d(grey, kernels).square().sum(1, keepdim=True).sqrt()


def inputs(planes):
    """The network's inputs, B x 16 x H x W: log(1 + radiance), its noise in these units, normal, albedo, depth, the
    noise of each (root of the variance of the pixel's mean), log(1 + gradient), count of samples."""
    color = crops.part(planes, "color").clamp(min=0)
    noise = crops.part(planes, "color_variance").sqrt() / (1 + color.mean(1, keepdim=True))

    def root(name):
        return crops.part(planes, name).sqrt().clamp(max=MOST_NOISE)

    return torch.cat([
        torch.log1p(color).clamp(max=MOST_LOG), noise.clamp(max=MOST_NOISE),
        crops.part(planes, "N").clamp(-1, 1), crops.part(planes, "albedo").clamp(-1, 1),
        crops.part(planes, "depth").clamp(0, 1),
        root("normal_variance"), root("albedo_variance"), root("depth_variance"),
        torch.log1p(gradient(crops.part(planes, "color"))).clamp(max=MOST_LOG), crops.part(planes, "count")], 1)


def _windows(planes):
    """B x C x H x W -> B x C x 289 x H x W, zeros beyond the border; a window's middle is its element 144."""
    b, c, h, w = planes.shape
    return F.unfold(F.pad(planes, (RADIUS,) * 4), 2 * RADIUS + 1).view(b, c, -1, h, w)


def filtered(planes, sigmas):
    """Cross-bilateral filter (7) to (9) with each pixel's own sigma_s, sigma_r, sigma_n, sigma_a, sigma_d, B x 5 x H x
    W. D of (8) is used without a square; variances are those of one sample, summed over the feature's channels."""
    color = crops.part(planes, "color")
    b, _, h, w = color.shape
    count = (2 ** (8 * crops.part(planes, "count")) - 1).clamp(min=1)
    side = torch.arange(-RADIUS, RADIUS + 1, device=color.device, dtype=color.dtype)
    distances = [(side[:, None] ** 2 + side ** 2).view(1, -1, 1, 1)]
    colors = _windows(color)
    distances.append((colors - color[:, :, None]).square().sum(1))
    for name, variance, channels in (("N", "normal_variance", 3), ("albedo", "albedo_variance", 3),
                                     ("depth", "depth_variance", 1)):
        feature = crops.part(planes, name)
        of_sample = crops.part(planes, variance) * count * channels
        squared = (_windows(feature) - feature[:, :, None]).square().sum(1)
        distances.append((squared / (_windows(of_sample)[:, 0] + of_sample).clamp(min=LEAST_VARIANCE)).sqrt())
    scales = 0.5 / sigmas.square()
    exponent = sum(d * scales[:, k:k + 1] for k, d in enumerate(distances))
    inside = _windows(torch.ones_like(color[:, :1]))[:, 0]
    weights = torch.where(exponent < CUT, torch.exp(-exponent.clamp(max=CUT)), torch.zeros_like(exponent)) * inside
    return (weights[:, None] * colors).sum(2) / weights.sum(1, keepdim=True)


class Printed(nn.Module):
    """Convolutions conv0, conv1, ..., 3x3, zeros beyond the border, ReLU but after the last."""

    def __init__(self, layers=6, width=32):
        super().__init__()
        self.name = "relume_printed"
        channels = [INPUTS] + [width] * (layers - 1) + [len(START)]
        for i in range(layers):
            self.add_module("conv%d" % i, nn.Conv2d(channels[i], channels[i + 1], 3, padding=1))
        crops.initialise(self)
        last = getattr(self, "conv%d" % (layers - 1))
        with torch.no_grad():
            last.weight.mul_(0.1)
            last.bias.copy_(torch.tensor([math.log(math.expm1(s - LEAST_SIGMA)) for s in START.values()]))

    def sigmas(self, x):
        return (LEAST_SIGMA + F.softplus(crops.run_stack(self, x))).clamp(max=MOST_SIGMA)

    def forward(self, planes):
        """Filtered radiance, B x 3 x H x W."""
        return filtered(planes, self.sigmas(inputs(planes)))


def main():
    parser = crops.parser(__doc__)
    parser.add_argument("--layers", type=int, default=6, help="convolutions; the paper has 64")
    parser.add_argument("--width", type=int, default=32, help="features between them; the paper has 128")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    crops.train(Printed(options.layers, options.width), options)


if __name__ == "__main__":
    main()
