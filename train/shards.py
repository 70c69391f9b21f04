"""The frames that frames.py made, in memory, and how they are cut and turned."""

import glob
import json
import os

import numpy as np
import torch

from model import slots_of

HELD_OUT = 10  # every scene whose seed this divides is kept from training


class Frames:
    """inputs N x C x H x W, candidates N x 3K x H x W, references S x 6 x H x W: half floats on one device.
    Frame i: mask[i] (K), scene[i], scale[i] (stored radiance = radiance times it), spp[i], held_out[i]."""

    def __init__(self, folder, device="cpu", limit=None):
        names = sorted(glob.glob(os.path.join(folder, "*.json")))[:limit]
        records = []
        for name in names:
            with open(name) as source:
                records.append(json.load(source))
        if not records:
            raise SystemExit("no frames in %s; make some with train/frames.py" % folder)
        self.names = records[0]["inputs"]
        self.slots = slots_of(self.names)
        count = sum(len(r["frames"]) for r in records)
        side = records[0]["size"]
        slots = len(self.slots)
        self.inputs = torch.zeros(count, len(self.names), side, side, dtype=torch.float16, device=device)
        self.candidates = torch.zeros(count, 3 * slots, side, side, dtype=torch.float16, device=device)
        self.references = torch.zeros(len(records), 6, side, side, dtype=torch.float16, device=device)
        self.mask = torch.zeros(count, slots)
        self.scene, self.scale, self.spp, self.held_out = [], [], [], []
        self.records = records
        at = 0
        for s, (name, record) in enumerate(zip(names, records)):
            if record["inputs"] != self.names or record["size"] != side:
                raise SystemExit("%s: other inputs or another size than %s; remove one of them" % (name, names[0]))
            base = name[:-len(".json")]
            n = len(record["frames"])
            self.inputs[at:at + n] = torch.from_numpy(np.load(base + ".inputs.npy")).to(device)
            candidates = torch.from_numpy(np.load(base + ".candidates.npy")).to(device)
            for k, slot in enumerate(record["candidates"]):
                to = self.slots.index(slot)
                self.candidates[at:at + n, 3 * to:3 * to + 3] = candidates[:, 3 * k:3 * k + 3]
                self.mask[at:at + n, to] = 1
            self.references[s] = torch.from_numpy(np.load(base + ".reference.npy")).to(device)
            self.scene += [s] * n
            self.scale += [record["scale"]] * n
            self.spp += [f["mean_spp"] for f in record["frames"]]
            self.held_out += [record["seed"] % HELD_OUT == 0] * n
            at += n
        self.mask = self.mask.to(device)
        self.scene = torch.tensor(self.scene, device=device)
        self.scale = torch.tensor(self.scale, dtype=torch.float32, device=device)
        self.held_out = np.array(self.held_out)
        if self.held_out.all() or not self.held_out.any():  # of few scenes the last
            self.held_out = self.scene.cpu().numpy() == len(records) - 1

    def __len__(self):
        return len(self.inputs)

    def whole(self, i):
        """inputs, candidates, reference, its noise of one frame, radiance in floats; a batch of one."""
        scale = self.scale[i]
        n, _, h, w = self.candidates[i:i + 1].shape
        reference = self.references[self.scene[i]][None].float() / scale
        return (self.inputs[i:i + 1].float(), (self.candidates[i:i + 1].float() / scale).view(n, -1, 3, h, w),
                reference[:, :3], reference[:, 3:])

    def crops(self, indices, side, rng):
        """The same of random squares of these frames, each turned and mirrored by chance; colours are permuted
        for all of them together. rng: numpy's."""
        device, b = self.inputs.device, len(indices)
        height, width = self.inputs.shape[2:]
        y0, x0 = (torch.from_numpy(rng.integers(0, n - side + 1, b)) for n in (height, width))
        rows, columns = turned(y0, x0, side, *(torch.from_numpy(rng.random(b) < 0.5) for _ in range(3)))
        rows, columns = rows.to(device), columns.to(device)
        indices = torch.as_tensor(indices, device=device)
        pick = lambda planes, which: planes[which[:, None, None], :, rows, columns].permute(0, 3, 1, 2).float()
        scale = self.scale[indices][:, None, None, None]
        inputs = pick(self.inputs, indices)
        candidates = pick(self.candidates, indices) / scale
        reference = pick(self.references[:, :3], self.scene[indices]) / scale
        colors = rng.permutation(3)
        order = permutation(self.names, colors)
        candidates = candidates.view(b, -1, 3, side, side)[:, :, colors.tolist()]
        return inputs[:, order], candidates, reference[:, colors.tolist()]


def turned(y0, x0, side, transpose, flip_y, flip_x):
    """Rows and columns (b x side x side) of squares at y0, x0, mirrored and transposed where those say so."""
    line = torch.arange(side)
    y = torch.where(flip_y[:, None], side - 1 - line, line)
    x = torch.where(flip_x[:, None], side - 1 - line, line)
    rows = y[:, :, None].expand(-1, side, side)
    columns = x[:, None, :].expand(-1, side, side)
    t = transpose[:, None, None]
    rows, columns = torch.where(t, rows.transpose(1, 2), rows), torch.where(t, columns.transpose(1, 2), columns)
    return rows + y0[:, None, None], columns + x0[:, None, None]


def permutation(names, colors):
    """Indices of the inputs when red, green, blue become colors[0], colors[1], colors[2] of what they were."""
    places = {name: i for i, name in enumerate(names)}
    order = list(range(len(names)))
    for i, name in enumerate(names):
        stem, dot, channel = name.rpartition(".")
        if dot and channel in ("R", "G", "B") and all(stem + "." + c in places for c in "RGB"):
            order[i] = places[stem + "." + "RGB"[colors["RGB".index(channel)]]]
    return order
