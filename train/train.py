#!/usr/bin/env python3
"""Trains networks that mix filters on frames that frames.py made.

    train/train.py --data FOLDER/shards --out RESULTS --seconds 600 [--variants FILE.json]

--variants: a list of objects with a "name" and what is to differ from DEFAULTS; they are trained one after the
other, each for --seconds. In RESULTS/NAME: model.tza, checkpoint.pt (the same command goes on from it), curve.csv,
metrics.json; in RESULTS: table.txt.
"""

import argparse
import copy
import csv
import json
import math
import os
import time

import numpy as np
import torch

import model
from shards import Frames

DEFAULTS = {
    "name": "blend",
    "encoder": list(model.ENCODER), "decoder": list(model.DECODER),
    "batch": 32, "crop": 96, "rate": 7e-4, "average": 0.998, "seed": 1,
    "structure": 0.5,      # weight of the L1 term
    "epsilon": 0.01,       # of the relative squared error
    "most": 1.0,           # a pixel's error is bent towards this
    "normalise": False,    # errors relative to those of the crop's best candidate
    "drop": 0.35,          # chance that a candidate is hidden
    "always": 2,           # so many of the first candidates never are
    "amp": False,          # bfloat16 on a GPU
}
BUCKETS = [(0, 5), (5, 10), (10, 24), (24, 1e9)]


def squared(out, reference, epsilon, most):
    """Relative squared error, a pixel; the denominator is not the reference alone, whose noise would bias it."""
    about = 0.5 * (out.detach() + reference)
    error = (out - reference) ** 2 / (about ** 2 + epsilon)
    return error / (1 + error / most)


def losses(out, candidates, mask, reference, o):
    """Loss, and plain mean of the squared term."""
    mean = lambda x: x.mean((1, 2, 3))
    error = mean(squared(out, reference, o["epsilon"], o["most"]))
    log = lambda x: torch.log1p(x.clamp(min=0) / 0.1)
    structure = mean((log(out) - log(reference)).abs())
    shown = error.mean()
    if o["normalise"]:
        with torch.no_grad():
            errors, structures = [], []
            for k in range(candidates.shape[1]):
                gone = 1e9 * (1 - mask[:, k])
                errors.append(mean(squared(candidates[:, k], reference, o["epsilon"], o["most"])) + gone)
                structures.append(mean((log(candidates[:, k]) - log(reference)).abs()) + gone)
            least, least_structure = (torch.stack(x).min(0).values for x in (errors, structures))
        error, structure = error / (least + 1e-4), structure / (least_structure + 1e-3)
    return ((1 - o["structure"]) * error + o["structure"] * structure).mean(), shown


def draw_mask(available, o, rng):
    mask = available.clone()
    keep = torch.from_numpy(rng.random(tuple(mask.shape)) >= o["drop"]).to(mask.device)
    keep[:, :o["always"]] = True
    keep[torch.from_numpy(rng.random(len(mask)) < 0.4).to(mask.device)] = True  # all that there are
    hidden = mask * keep
    too_few = hidden.sum(1) < 2
    hidden[too_few] = mask[too_few]
    return hidden


class Average:
    """Of the weights, exponentially weighted."""

    def __init__(self, network, decay):
        self.network, self.decay, self.step = copy.deepcopy(network), decay, 0

    @torch.no_grad()
    def update(self, network):
        self.step += 1
        decay = min(self.decay, (1 + self.step) / (10 + self.step))
        for mine, its in zip(self.network.parameters(), network.parameters()):
            mine.lerp_(its, 1 - decay)


def train(frames, o, folder, seconds, steps=None):
    """Trains for so long, or so many steps; goes on from the folder's checkpoint. Returns the mean network, facts."""
    os.makedirs(folder, exist_ok=True)
    device = frames.inputs.device
    torch.manual_seed(o["seed"])
    network = model.Blend(len(frames.names), len(frames.slots), o["encoder"], o["decoder"]).to(device)
    mean = Average(network, o["average"])
    adam = torch.optim.Adam(network.parameters(), lr=o["rate"], betas=(0.9, 0.99))
    rng = np.random.default_rng(o["seed"])
    step, spent, rows = 0, 0.0, []
    checkpoint = os.path.join(folder, "checkpoint.pt")
    if os.path.exists(checkpoint):
        saved = torch.load(checkpoint, map_location=device)
        if saved["options"] != o:
            raise SystemExit("%s was made with other options; remove it to begin anew" % checkpoint)
        network.load_state_dict(saved["network"])
        mean.network.load_state_dict(saved["mean"])
        adam.load_state_dict(saved["adam"])
        mean.step, step, spent, rows = saved["step"], saved["step"], saved["spent"], saved["rows"]
        rng = np.random.default_rng([o["seed"], step])
    training = np.flatnonzero(~frames.held_out)

    def save():
        torch.save({"options": o, "network": network.state_dict(), "mean": mean.network.state_dict(),
                    "adam": adam.state_dict(), "step": step, "spent": spent, "rows": rows}, checkpoint + ".part")
        os.replace(checkpoint + ".part", checkpoint)
        with open(os.path.join(folder, "curve.csv"), "w", newline="") as out:
            csv.writer(out).writerows([("step", "seconds", "rate", "loss", "relative_squared_error"), *rows])

    last, saved_at = time.time(), time.time()
    sums = torch.zeros(3, device=device)
    while step < steps if steps is not None else spent < seconds:
        progress = step / steps if steps is not None else spent / seconds
        rate = o["rate"] * min(1, 0.02 + progress / 0.02) * (0.5 + 0.5 * math.cos(math.pi * min(progress, 1)))
        for group in adam.param_groups:
            group["lr"] = rate
        chosen = rng.choice(training, o["batch"])
        inputs, candidates, reference = frames.crops(chosen, o["crop"], rng)
        mask = draw_mask(frames.mask[torch.as_tensor(chosen, device=device)], o, rng)
        inputs = model.hidden(inputs, frames.names, frames.slots, mask)
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=o["amp"] and device.type == "cuda"):
            logits = network(inputs)
        out = model.blended(model.masked_softmax(logits.float(), mask), candidates)
        loss, shown = losses(out, candidates, mask, reference, o)
        adam.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        adam.step()
        mean.update(network)
        step += 1
        sums += torch.stack([loss.detach(), shown.detach(), torch.ones((), device=device)])
        if step % 50 == 0 or device.type == "cpu":
            if device.type == "cuda":
                torch.cuda.synchronize()
            now = time.time()
            spent, last = spent + now - last, now
        if step % 50 == 0:
            a, b, n = sums.tolist()
            if not math.isfinite(a):
                raise RuntimeError("%s: the loss is not finite at step %d" % (o["name"], step))
            rows.append((step, round(spent, 2), "%.3g" % rate, "%.6g" % (a / n), "%.6g" % (b / n)))
            sums.zero_()
            if step % 500 == 0:
                print("%s: step %d, %.0f s, loss %s" % (o["name"], step, spent, rows[-1][3]), flush=True)
            if time.time() - saved_at > 60:
                save()
                saved_at = time.time()
    save()
    mean.network.export(os.path.join(folder, "model.tza"))
    return mean.network, {"steps": step, "seconds": round(spent, 1), "weights": network.weight_count(),
                          "kmac_per_pixel": round(network.kmac_per_pixel(), 2)}


# --- how good it is, on scenes that it was not trained on ---


def subsets(slots, mask):
    """{name: mask} of what may be there; only what some frame has."""
    have = [s for k, s in enumerate(slots) if mask[:, k].any()]
    base, rest = have[:2], have[2:]
    choices = {"all": have}
    for r in rest:
        choices["without " + r] = [s for s in have if s != r]
    for r in rest:
        choices["+".join([*base[1:], r])] = [*base, r]
    if rest:
        choices["+".join(base[1:])] = base
    if "oidn" in rest and len(rest) > 1:
        choices["without oidn"] = [s for s in have if s != "oidn"]
    unique = {}
    for name, chosen in choices.items():
        key = tuple(s in chosen for s in slots)
        if key not in unique.values():
            unique[name] = key
    return {name: torch.tensor(key, dtype=torch.float32) for name, key in unique.items()}


def mrse(image, reference, noise, epsilon=1e-3):
    """Mean of (x - r)^2 / (r^2 + epsilon), less the reference's own noise, without the 0.1 % of the pixels where
    that noise is largest."""
    own = (noise ** 2 / (reference ** 2 + epsilon)).mean(1).flatten()
    error = ((image - reference) ** 2 / (reference ** 2 + epsilon)).mean(1).flatten()
    keep = own <= torch.quantile(own, 0.999)
    plain, own = float(error[keep].double().mean()), float(own[keep].double().mean())
    return max(plain - own, 0.05 * plain)


@torch.no_grad()
def evaluate(network, frames):
    """A row a frame and subset: spp, errors of the result, of each candidate, of their mean."""
    device = frames.inputs.device
    network.eval()
    rows = []
    choices = subsets(frames.slots, frames.mask)
    step = 2 ** (network.levels - 1)
    for i in np.flatnonzero(frames.held_out):
        i = int(i)
        inputs, candidates, reference, noise = frames.whole(i)
        h, w = inputs.shape[2:]
        errors = [mrse(candidates[:, k], reference, noise) if frames.mask[i, k] else None
                  for k in range(len(frames.slots))]
        for name, chosen in choices.items():
            mask = chosen.to(device)[None] * frames.mask[i:i + 1]
            if mask.sum() < 2 or not bool((mask == chosen.to(device)).all()):
                continue
            x = model.hidden(inputs.clone(), frames.names, frames.slots, mask)
            x = torch.nn.functional.pad(x, (0, -w % step, 0, -h % step))
            weights = model.masked_softmax(network(x)[:, :, :h, :w], mask)
            even = mask[:, :, None, None, None]
            rows.append({
                "subset": name, "spp": frames.spp[i], "seed": frames.records[int(frames.scene[i])]["seed"],
                "layout": frames.records[int(frames.scene[i])]["layout"],
                "result": mrse(model.blended(weights, candidates), reference, noise),
                "mean": mrse((candidates * even).sum(1) / even.sum(1), reference, noise),
                "candidates": {s: errors[k] for k, s in enumerate(frames.slots) if mask[0, k]},
                "shares": {s: round(float(weights[:, k].mean()), 4) for k, s in enumerate(frames.slots) if mask[0, k]},
            })
    return rows


def ratios(rows):
    """{against: geometric mean of the result's error over that one's}"""
    if not rows:
        return {}
    geometric = lambda values: float(np.exp(np.mean(np.log(np.maximum(values, 1e-12)))))
    result = {s: geometric([r["result"] / max(r["candidates"][s], 1e-12) for r in rows]) for s in rows[0]["candidates"]}
    result["best"] = geometric([r["result"] / max(min(r["candidates"].values()), 1e-12) for r in rows])
    result["mean"] = geometric([r["result"] / max(r["mean"], 1e-12) for r in rows])
    # The one candidate that is best over all frames, which a fixed choice would take.
    result["fixed"] = max(result[s] for s in rows[0]["candidates"])
    return result


def table(results):
    """Text: geometric means of MrSE over that of each candidate, of the best one of each frame, of the best one
    over all frames ("fixed") and of their even mean."""
    lines = []
    for name, (rows, facts) in results.items():
        lines.append("%s: %d weights, %.1f kMAC a pixel, %d steps in %.0f s; %d held-out frames" % (
            name, facts["weights"], facts["kmac_per_pixel"], facts["steps"], facts["seconds"],
            len({(r["seed"], r["spp"]) for r in rows})))
        names = sorted({s for r in rows for s in ratios([r])}, key=lambda s: (s in ("best", "fixed", "mean"), s))
        lines.append("  %-22s %-8s %6s " % ("candidates", "spp", "frames") + " ".join("%9s" % n for n in names))
        for subset in dict.fromkeys(r["subset"] for r in rows):
            of_it = [r for r in rows if r["subset"] == subset]
            for low, high in [(0, 1e9), *(BUCKETS if subset == list(dict.fromkeys(r["subset"] for r in rows))[0] else [])]:
                chosen = [r for r in of_it if low <= r["spp"] < high]
                if chosen:
                    values = ratios(chosen)
                    label = "all" if high - low >= 1e9 and low == 0 else "%g-%s" % (low, "" if high >= 1e9 else "%g" % high)
                    lines.append("  %-22s %-8s %6d " % (subset, label, len(chosen)) + " ".join(
                        "%9.3f" % values[n] if n in values else "%9s" % "" for n in names))
    return "\n".join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", required=True, help="folder of the shards")
    parser.add_argument("--out", required=True)
    parser.add_argument("--seconds", type=float, default=600, help="of training, each variant")
    parser.add_argument("--steps", type=int, help="of training, instead of --seconds")
    parser.add_argument("--variants", help="JSON file")
    parser.add_argument("--threads", type=int, help="of PyTorch")
    parser.add_argument("--device", help="cpu or cuda [cuda if there is one]")
    parser.add_argument("--limit", type=int, help="so many scenes alone")
    options = parser.parse_args(arguments)
    if options.threads:
        torch.set_num_threads(options.threads)
    device = torch.device(options.device or ("cuda" if torch.cuda.is_available() else "cpu"))
    torch.backends.cudnn.benchmark = True
    started = time.time()
    frames = Frames(options.data, device, options.limit)
    print("%d frames of %d scenes, %d held out, on %s, loaded in %.1f s" % (
        len(frames), len(frames.records), frames.held_out.sum(), device, time.time() - started), flush=True)
    print("inputs: %s; candidates: %s" % (" ".join(frames.names), " ".join(frames.slots)), flush=True)
    variants = [{}]
    if options.variants:
        with open(options.variants) as source:
            variants = json.load(source)
    results = {}
    os.makedirs(options.out, exist_ok=True)
    for variant in variants:
        unknown = set(variant) - set(DEFAULTS)
        if unknown:
            raise SystemExit("%s: unknown: %s; known: %s" % (options.variants, ", ".join(sorted(unknown)), ", ".join(DEFAULTS)))
        o = {**DEFAULTS, **variant}
        folder = os.path.join(options.out, o["name"])
        network, facts = train(frames, o, folder, options.seconds, options.steps)
        rows = evaluate(network, frames)
        results[o["name"]] = (rows, facts)
        with open(os.path.join(folder, "metrics.json"), "w") as out:
            json.dump({"options": o, "facts": facts, "inputs": frames.names, "candidates": frames.slots,
                       "scenes": len(frames.records), "frames": len(frames), "held_out": rows,
                       "ratios": {s: ratios([r for r in rows if r["subset"] == s]) for s in {r["subset"] for r in rows}}},
                      out, indent=1)
        text = table(results)
        with open(os.path.join(options.out, "table.txt"), "w") as out:
            out.write(text + "\n")
        print(table({o["name"]: results[o["name"]]}), flush=True)
    if len(results) > 1:
        print(text)


if __name__ == "__main__":
    main()
