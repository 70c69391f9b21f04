#!/usr/bin/env python3
"""KPCN (Bako et al. 2017) in one branch: a network says for each pixel what the kernel is that filters it.

The film does not part diffuse from specular light, so that the paper's diffuse branch gets all of it: radiance over
albedo is filtered, and multiplied back. server/denoise/kpcn*.cpp does the same; what is said here of one is said of
both.

    train/kpcn.py --data FOLDER/shards --seconds 90 --out relume_kpcn_lite.tza
"""

import torch
import torch.nn as nn
import torch.nn.functional as F

import crops

# name: (convolutions, their kernel's side, features between them, radius of the kernel that they say)
SIZES = {"lite": (5, 5, 32, 6), "full": (9, 5, 100, 10)}

ALBEDO_FLOOR = 0.03    # the paper has 0.00316; what black surfaces mirror would outshine what is beside them
MOST_LOG, MOST_NOISE = 16.0, 4.0


def demodulation(planes):
    """What the radiance is divided by, B x 3 x H x W: albedo + 0.03, and 1 more where no surface is. No step between
    these: what is divided by little must not meet what is divided by 1."""
    open_part = (1 - crops.part(planes, "N").square().sum(1, keepdim=True).sqrt()).clamp(min=0)
    return crops.part(planes, "albedo").clamp(0, 1) + open_part + ALBEDO_FLOOR


def _with_slopes(mean, noise):
    """The mean's channels, the noise, then the steps from the left neighbours, then from those above."""
    across, down = torch.zeros_like(mean), torch.zeros_like(mean)
    across[..., 1:] = mean[..., 1:] - mean[..., :-1]
    down[..., 1:, :] = mean[..., 1:, :] - mean[..., :-1, :]
    return [mean, noise, across, down]


def inputs(planes):
    """The network's inputs, B x 34 x H x W, of crops' planes: each of colour, normal, depth, albedo with its noise
    (root of the variance of the pixel's mean, which the paper has squared) and slopes. Colour: log(1 + radiance over
    albedo), and its noise in these units."""
    divisor = demodulation(planes)
    demodulated = crops.part(planes, "color").clamp(min=0) / divisor
    scale = divisor.mean(1, keepdim=True) * (1 + demodulated.mean(1, keepdim=True))

    def noise(name):
        return crops.part(planes, name).sqrt()

    return torch.cat(
        _with_slopes(torch.log1p(demodulated).clamp(max=MOST_LOG),
                     (noise("color_variance") / scale).clamp(max=MOST_NOISE))
        + _with_slopes(crops.part(planes, "N").clamp(-1, 1), noise("normal_variance").clamp(max=MOST_NOISE))
        + _with_slopes(crops.part(planes, "depth").clamp(0, 1), noise("depth_variance").clamp(max=MOST_NOISE))
        + _with_slopes(crops.part(planes, "albedo").clamp(-1, 1), noise("albedo_variance").clamp(max=MOST_NOISE)), 1)


class Kpcn(nn.Module):
    """Convolutions conv0, conv1, ..., zeros beyond the border, ReLU but after the last."""

    def __init__(self, size="lite"):
        super().__init__()
        layers, side, width, self.radius = SIZES[size]
        self.name = "relume_kpcn_" + size
        outputs = (2 * self.radius + 1) ** 2
        channels = [34] + [width] * (layers - 1) + [outputs]
        for i in range(layers):
            self.add_module("conv%d" % i, nn.Conv2d(channels[i], channels[i + 1], side, padding=side // 2))
        crops.initialise(self)
        with torch.no_grad():  # begins about as the window's plain mean
            getattr(self, "conv%d" % (layers - 1)).weight.mul_(0.1)

    def logits(self, x):
        return crops.run_stack(self, x)

    def forward(self, planes):
        """Filtered radiance, B x 3 x H x W."""
        divisor = demodulation(planes)
        return divisor * apply_kernels(self.logits(inputs(planes)), crops.part(planes, "color") / divisor, self.radius)


def apply_kernels(logits, image, radius):
    """Mean of each pixel's window by the weights exp(logit), row by row from the upper left; the image is mirrored
    beyond its border (without its last row once more)."""
    b, c, h, w = image.shape
    weights = torch.softmax(logits, 1)
    windows = F.unfold(F.pad(image, (radius,) * 4, mode="reflect"), 2 * radius + 1)
    return (weights[:, None] * windows.view(b, c, -1, h, w)).sum(2)


def main():
    parser = crops.parser(__doc__)
    parser.add_argument("--size", choices=list(SIZES), default="lite")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    crops.train(Kpcn(options.size), options)


if __name__ == "__main__":
    main()
