"""What the trainers of kpcn.py and printed.py share: shards (frames.py) as crops of planes, the loop, the report.

Planes of a noisy frame, B x 15 x H x W: see PLANES. Radiance is linear, variances are those of the pixel's mean (mean
of the channels), depth is over the frame's largest, count is log2(1 + samples) / 8.
"""

import argparse
import glob
import json
import math
import os
import time

import numpy as np
import torch
import torch.nn as nn

import tza
from shards import HELD_OUT, turned
from train import mrse

PLANES = {"color": 3, "albedo": 3, "N": 3, "depth": 1, "color_variance": 1, "albedo_variance": 1, "normal_variance": 1,
          "depth_variance": 1, "count": 1}
_FIRST = dict(zip(PLANES, np.cumsum([0] + list(PLANES.values()))))
COUNT = sum(PLANES.values())

REPORTS = 6          # in all
LOSS_EPSILON = 0.05  # radiance; frames are exposed so that its logarithm's mean is about that of 0.18


def part(planes, name):
    return planes[:, _FIRST[name]:_FIRST[name] + PLANES[name]]


def initialise(model):
    for module in model.modules():
        if isinstance(module, nn.Conv2d):
            nn.init.kaiming_uniform_(module.weight, nonlinearity="relu")
            nn.init.zeros_(module.bias)


def run_stack(model, x):
    """Convolutions conv0, conv1, ... one after another, ReLU but after the last."""
    layers = [m for m in model.children() if isinstance(m, nn.Conv2d)]
    for layer in layers[:-1]:
        x = torch.relu(layer(x))
    return layers[-1](x)


class Frames:
    """Noisy frames on a device, N x 15 x H x W, and their references with the noise of these, N x 6 x H x W. With
    `judged`, also the MrSE of each candidate: [{name: MrSE}]."""

    def __init__(self, folder, held_out, device, judged=False):
        self.candidates = []
        planes, references = [], []
        for path in sorted(glob.glob(os.path.join(folder, "*.json"))):
            with open(path) as source:
                record = json.load(source)
            if (record["seed"] % HELD_OUT == 0) == held_out:
                for frame, reference in self._read(path[:-len("json")], record, judged):
                    if planes and frame.shape != planes[0].shape:
                        raise SystemExit("%s: of another size than those before; remove it" % path)
                    planes.append(frame)
                    references.append(reference)
        if not planes:
            raise SystemExit("%s: no frames of scenes whose seed %s a multiple of %d; make some with train/frames.py"
                             % (folder, "is" if held_out else "is not", HELD_OUT))
        self.planes = torch.from_numpy(np.stack(planes)).to(device)
        self.references = torch.from_numpy(np.stack(references)).to(device)

    def _read(self, base, record, judged):
        if not record.get("extras"):
            raise SystemExit("%sjson: without variances; make frames with train/frames.py --extras" % base)
        inputs, candidates, extras = (np.load(base + name + ".npy", mmap_mode="r")
                                      for name in ("inputs", "candidates", "extras"))
        to_radiance = np.float32(1 / record["scale"])
        reference = np.load(base + "reference.npy").astype(np.float32) * to_radiance
        seen = [record["inputs"].index(name) for name in ("albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z")]
        count = record["inputs"].index("count")
        extra = [record["extras"].index(name) for name in list(PLANES)[3:8]]
        for k in range(len(record["frames"])):
            images = {name: candidates[k, 3 * c:3 * c + 3].astype(np.float32) * to_radiance
                      for c, name in enumerate(record["candidates"]) if judged or name == "none"}
            planes = np.concatenate([images["none"], inputs[k][seen], extras[k][extra], inputs[k][count:count + 1]])
            if judged:
                self.candidates.append({name: _mrse(torch.from_numpy(image)[None], torch.from_numpy(reference)[None])
                                        for name, image in images.items()})
            yield planes.astype(np.float32), reference

    def __len__(self):
        return len(self.planes)

    def whole(self, k):
        """Planes and reference with its noise of frame k; a batch of one."""
        return self.planes[k:k + 1], self.references[k:k + 1]

    def crops(self, rng, count, side):
        """Planes and references of random squares, each turned, its light and its space changed by chance."""
        device, (height, width) = self.planes.device, self.planes.shape[2:]
        side = min(side, height, width)
        chosen = torch.from_numpy(rng.integers(0, len(self), count)).to(device)[:, None, None]
        y0, x0 = (torch.from_numpy(rng.integers(0, n - side + 1, count)) for n in (height, width))
        rows, columns = turned(y0, x0, side, *(torch.from_numpy(rng.random(count) < 0.5) for _ in range(3)))
        rows, columns = rows.to(device), columns.to(device)
        order = np.tile(np.arange(COUNT), (count, 1))
        colors, axes = (rng.permuted(np.tile(np.arange(3), (count, 1)), axis=1) for _ in range(2))
        order[:, 0:3], order[:, 3:6], order[:, 6:9] = colors, 3 + colors, 6 + axes
        factors = np.ones((count, COUNT), np.float32)
        exposure = 2.0 ** rng.normal(size=(count, 1))
        factors[:, 0:3] = exposure
        factors[:, 6:9] = rng.choice([-1.0, 1.0], (count, 3))
        factors[:, _FIRST["color_variance"]] = exposure[:, 0] ** 2

        def pick(planes, order, factors):
            cut = planes[chosen, :, rows, columns].permute(0, 3, 1, 2)
            order, factors = (torch.from_numpy(v).to(device)[:, :, None, None] for v in (order, factors))
            return torch.gather(cut, 1, order.expand(-1, -1, side, side)) * factors

        return pick(self.planes, order, factors), pick(self.references, colors, factors[:, 0:3])


def relative_l1(image, reference):
    return ((image - reference).abs() / (reference.mean(1, keepdim=True).clamp(min=0) + LOSS_EPSILON)).mean()


def _mrse(image, reference):
    """Of an image, against a reference with its noise; batches of one."""
    return max(mrse(image, reference[:, :3], reference[:, 3:]), 1e-12)


def judge(model, frames, every=1):
    """MrSE over each candidate's, geometric means over frames, and that of MrSE itself: {candidate: ratio}."""
    logs = {}
    model.eval()
    with torch.no_grad():
        for k in range(0, len(frames), every):
            planes, reference = frames.whole(k)
            own = _mrse(model(planes), reference)
            logs.setdefault("MrSE", []).append(math.log(own))
            for name, candidate in frames.candidates[k].items():
                logs.setdefault("over " + name, []).append(math.log(own / candidate))
    model.train()
    return {name: round(math.exp(np.mean(values)), 5) for name, values in logs.items()}


def parser(text):
    made = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--data", required=True, help="folder of the shards, made with --extras")
    made.add_argument("--out", required=True, help="archive to write, .tza; the report goes beside it, .json")
    made.add_argument("--seconds", type=float, default=90, help="of training, after the data is read")
    made.add_argument("--steps", type=int, help="of training, instead of --seconds")
    made.add_argument("--batch", type=int, help="crops a step; 32 on a GPU, 4 without")
    made.add_argument("--crop", type=int, default=64, help="side, pixels")
    made.add_argument("--rate", type=float, default=1e-3, help="of learning, at its highest")
    made.add_argument("--seed", type=int, default=1)
    made.add_argument("--state", help="file to go on from, written at each report")
    return made


def _rate(part_done):
    """Of the highest: up over the first fiftieth, then down by a cosine."""
    return min(part_done / 0.02 + 0.01, 1) * (0.5 + 0.5 * math.cos(math.pi * min(part_done, 1)))


def _save(model, options, report):
    tza.write({name: value.cpu().numpy() for name, value in model.state_dict().items()}, options.out)
    with open(os.path.splitext(options.out)[0] + ".json", "w") as out:
        json.dump(report, out, indent=1)


def train(model, options):
    device = "cuda" if torch.cuda.is_available() else "cpu"
    torch.backends.cudnn.benchmark = True
    torch.backends.cudnn.allow_tf32 = torch.backends.cuda.matmul.allow_tf32 = True
    batch = options.batch or (32 if device == "cuda" else 4)
    frames = Frames(options.data, False, device)
    held_out = Frames(options.data, True, device, judged=True)
    model.to(device)
    adam = torch.optim.Adam(model.parameters(), lr=options.rate)
    step, before, curve = 0, 0.0, []
    if options.state and os.path.exists(options.state):
        state = torch.load(options.state, map_location=device)
        model.load_state_dict(state["model"])
        adam.load_state_dict(state["adam"])
        step, before, curve = state["step"], state["seconds"], state["curve"]
    report = {"network": model.name, "weights": sum(p.numel() for p in model.parameters()),
              "frames": len(frames), "held_out": len(held_out), "device": device, "batch": batch,
              "crop": options.crop, "rate": options.rate, "curve": curve}
    print(json.dumps(report), flush=True)
    rng = np.random.default_rng([options.seed, step])
    started, losses, next_report = time.time(), [], None
    while True:
        seconds = before + time.time() - started
        done = step / options.steps if options.steps else seconds / options.seconds
        next_report = next_report or math.floor(done * REPORTS) + 1
        if done * REPORTS >= next_report or done >= 1:
            next_report = math.floor(done * REPORTS) + 1
            # Until the end of a few frames: what it takes counts as training.
            ratios = judge(model, held_out, 1 if done >= 1 else max(1, len(held_out) // 12))
            curve.append({"step": step, "seconds": round(seconds, 1), "held_out": ratios,
                          "loss": round(float(torch.stack(losses).mean()), 6) if losses else None})
            losses = []
            print(json.dumps(curve[-1]), flush=True)
            _save(model, options, report)
            if options.state:
                torch.save({"model": model.state_dict(), "adam": adam.state_dict(), "step": step, "seconds": seconds,
                            "curve": curve}, options.state + ".part")
                os.replace(options.state + ".part", options.state)
            if done >= 1:
                return
        for group in adam.param_groups:
            group["lr"] = options.rate * _rate(done)
        planes, reference = frames.crops(rng, batch, options.crop)
        loss = relative_l1(model(planes), reference)
        adam.zero_grad()
        loss.backward()
        norm = nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        if torch.isfinite(norm):
            adam.step()
        losses.append(loss.detach())
        step += 1
