"""Trains the small text-to-image model of `wake train text-to-image` in PyTorch, on a GPU.

    wake dataset --grid crates/wake-cli/src/train/text_to_image.toml --count 40000 --val-share 0 --out DATA
    wake train text-to-image --data DATA --steps 1 --out MODEL
    python benches/torch_text_to_image.py MODEL DATA --samples 80000,250000,500000,1000000
    wake evaluate pipeline --weights MODEL-1000000 --count 60

Needs torch, diffusers, transformers, pillow. The second command fits the autoencoder and trains the text encoder alone; the U-Net begins
with random weights. Loss, optimizer, averages and schedule are those of `wake train text-to-image`, the batch is larger. Convolutions
of burn's backends for GPUs take many times as long as torch's (docs/reports/performance.md), and a million images take minutes here
instead of hours. It writes one folder for each number of images seen, which `wake` reads like MODEL itself, and goes on where it was
stopped.
"""

import argparse
import json
import math
import shutil
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from diffusers import UNet2DConditionModel
from PIL import Image
from safetensors.torch import load_file, save_file
from transformers import CLIPTextConfig, CLIPTextModel, CLIPTokenizer

WARMUP, DECAY, LEFT_OUT, EAGER, HELD_OUT = 100, 0.999, 0.1, 3, 64
BLIND, MOST_BLIND, MEAN, FIRST = 0.3, 19_200, 0.03, 4.0
VAE = "vae/diffusion_pytorch_model.safetensors"
UNET = "unet/diffusion_pytorch_model.safetensors"
TEXT = "text_encoder/model.safetensors"


def grey(path):
    return np.asarray(Image.open(path).convert("L"))


def images(folder, count, device):
    """Grey of the first images of a data set, bytes `[count, 1, rows, columns]`, and their prompts."""
    lines = [json.loads(line) for line in (folder / "metadata.jsonl").read_text().splitlines()[:count]]
    with ProcessPoolExecutor() as pool:
        pixels = np.stack(list(pool.map(grey, [folder / line["file_name"] for line in lines], chunksize=64)))
    return torch.from_numpy(pixels)[:, None].to(device), [line["text"] for line in lines]


def scaled(pixels):
    return pixels.float() / 127.5 - 1


class Learning:
    """Adam with warm-up, half a cosine, gradients of norm 1 and averaged weights; one step is one CUDA graph."""

    def __init__(self, modules, loss, steps, options):
        self.modules, self.loss, self.peak, self.steps, self.done = modules, loss, options.rate, steps, 0
        self.weights = [weight for module in modules for weight in module.parameters()]
        self.averages = [weight.detach().clone() for weight in self.weights]
        device = self.weights[0].device
        self.rate = torch.zeros((), device=device)
        self.keep = torch.zeros((), device=device)
        self.part = torch.zeros((), device=device)
        self.value = torch.zeros((), device=device)
        self.optimizer = torch.optim.AdamW(
            self.weights, lr=self.rate, betas=(0.9, 0.99), eps=1e-8, weight_decay=1e-2, capturable=device.type == "cuda"
        )
        self.graph, self.eager = None, EAGER

    def constants(self):
        step = self.done
        if step < WARMUP:
            rate = self.peak * (step + 1) / WARMUP
        else:
            part = min((step - WARMUP) / max(self.steps - WARMUP, 1), 1)
            rate = self.peak * (0.1 + 0.45 * (1 + math.cos(math.pi * part)))
        self.rate.fill_(rate)
        self.part.fill_(step / self.steps)
        self.keep.fill_(min(DECAY, 1 - (2 + step) ** (-2 / 3)))

    def compute(self):
        self.optimizer.zero_grad(set_to_none=False)
        loss = self.loss(self.part)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.weights, 1.0)
        self.optimizer.step()
        for average, weight in zip(self.averages, self.weights):
            average.lerp_(weight.detach(), 1 - self.keep)
        self.value.copy_(loss.detach())

    def step(self):
        self.constants()
        if self.value.device.type != "cuda":
            self.compute()
        elif self.eager > 0:
            # Kernels are chosen in the first steps, outside of the graph.
            self.eager -= 1
            side = torch.cuda.Stream()
            side.wait_stream(torch.cuda.current_stream())
            with torch.cuda.stream(side):
                self.compute()
            torch.cuda.current_stream().wait_stream(side)
        else:
            if self.graph is None:
                torch.cuda.synchronize()
                self.graph = torch.cuda.CUDAGraph()
                with torch.cuda.graph(self.graph):
                    self.compute()
            self.graph.replay()
        self.done += 1

    def state(self):
        return {"done": self.done, "steps": self.steps, "averages": self.averages, "optimizer": self.optimizer.state_dict(),
                "weights": [weight.detach() for weight in self.weights]}

    def resume(self, state):
        assert state["steps"] == self.steps, "a run of another length"
        self.done, self.averages = state["done"], state["averages"]
        self.copy(state["weights"])
        self.optimizer.load_state_dict(state["optimizer"])
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate

    @contextmanager
    def averages_in_place(self):
        """The modules have the averaged weights for a while."""
        own = [weight.detach().clone() for weight in self.weights]
        self.copy(self.averages)
        yield
        self.copy(own)

    def copy(self, values):
        with torch.no_grad():
            for weight, value in zip(self.weights, values):
                weight.copy_(value)

    def averaged(self):
        """The averaged weights of each module, by their names."""
        values = iter(self.averages)
        return [{name: next(values).cpu() for name, _ in module.named_parameters()} for module in self.modules]


def halves(tensors):
    return {name: value.to(torch.float16).contiguous() for name, value in tensors.items()}


def encoded(folder, pixels):
    """Latents of all images by the linear autoencoder of a folder."""
    config = json.loads((folder / "vae/config.json").read_text())
    assert not config["block_out_channels"], "a convolutional autoencoder"
    channels = config["latent_channels"]
    layer = load_file(folder / VAE)
    weight, bias = (layer[f"quant_conv.{name}"][:channels].float().to(pixels.device) for name in ("weight", "bias"))
    squares = (F.pixel_unshuffle(scaled(part), config["patch_size"]) for part in pixels.split(64))
    return torch.cat([F.conv2d(part, weight, bias).half() for part in squares])


def train(options, device):
    pixels, prompts = images(options.data, options.images, device)
    latents = encoded(options.model, pixels)
    del pixels
    print(f"latents {list(latents.shape)}, mean {latents.float().mean():.4f}, variance {latents.float().var():.4f}", flush=True)
    tokenizer = CLIPTokenizer.from_pretrained(options.model / "tokenizer")
    ids = tokenizer(prompts + [""], padding="max_length", max_length=77, truncation=True, return_tensors="pt").input_ids.to(device)
    unet = UNet2DConditionModel.from_config(json.loads((options.model / "unet/config.json").read_text()))
    text = CLIPTextModel(CLIPTextConfig.from_json_file(options.model / "text_encoder/config.json"))
    if not options.random_text:
        weights = {name.removeprefix("text_model."): value.float() for name, value in load_file(options.model / TEXT).items()}
        own = [name for name, _ in text.named_parameters()]
        text.load_state_dict({name: weights[name.removeprefix("text_model.")] for name in own}, strict=False)
    unet, text = unet.to(device).train(), text.to(device).train()
    schedule = json.loads((options.model / "scheduler/scheduler_config.json").read_text())
    assert schedule["prediction_type"] == "v_prediction" and schedule["rescale_betas_zero_snr"]
    betas = torch.linspace(schedule["beta_start"] ** 0.5, schedule["beta_end"] ** 0.5, 1000, dtype=torch.float64) ** 2
    root = torch.cumprod(1 - betas, 0).sqrt()
    kept = ((root - root[-1]) * root[0] / (root[0] - root[-1])).square().float().to(device)
    count = latents.shape[0] - HELD_OUT

    def noised(clean, noise, level):
        """Input of the U-Net and its target."""
        signal, spread = level.sqrt(), (1 - level).sqrt()
        return signal * clean + spread * noise, signal * noise - spread * clean

    def loss(part):
        """Loss of a batch after a part of the training. The first examples have no noise and no signal, the prompt alone."""
        which = torch.randint(count, (options.batch,), device=device)
        left_out = torch.rand(options.batch, device=device) < LEFT_OUT
        told = ids[torch.where(left_out, count + HELD_OUT, which)]
        t = torch.randint(1000, (options.batch,), device=device)
        if not options.uniform:
            t[1::2] = 900 + t[1::2] // 10
        seen = torch.ones_like(part) if options.uniform else (part >= blind).float()
        t = torch.where(seen > 0, t, 999)
        clean = latents[which].float()
        noise = torch.randn_like(clean)
        sample, target = noised(clean, noise, kept[t][:, None, None, None])
        with torch.autocast(device.type, torch.bfloat16, options.bf16, cache_enabled=False):
            found = unet(sample * seen, t, text(told).last_hidden_state).sample
        error = found.float() - target
        if options.uniform:
            return error.square().mean()
        mean = error.mean(dim=(2, 3), keepdim=True)
        varying = (error - mean).square()
        first = varying[:, 0].mean() * (FIRST - 1) / error.shape[1]
        return varying.mean() + first + MEAN * mean.square().mean()

    def unexplained(prompts):
        """Share of the variance of held-out latents that the averaged model leaves open, in steps of little and much noise."""
        random = torch.Generator(device).manual_seed(1)
        clean = latents[count:].float()
        noise = torch.randn(clean.shape, generator=random, device=device)
        shares = []
        for step in (500, 800, 900, 950, 990, 999):
            level = kept[step]
            sample, target = noised(clean, noise, level)
            found = unet(sample, torch.full((HELD_OUT,), step, device=device), text(prompts).last_hidden_state).sample
            error = (found - target).square().mean() * (1 - level)
            shares.append(f"{step}: {float(error / clean.var()):.3f}")
        return ", ".join(shares)

    marks = [int(mark) for mark in options.samples.split(",")]
    blind = min(BLIND, MOST_BLIND / marks[-1])
    learning = Learning([text, unet], loss, marks[-1] // options.batch, options)
    checkpoint = options.model / "torch.pt"
    if checkpoint.exists():
        state = torch.load(checkpoint, map_location=device, weights_only=True)
        learning.resume(state)
        torch.manual_seed(options.seed + learning.done)
    begin = time.monotonic()
    for mark in marks:
        if mark // options.batch <= learning.done:
            continue
        left = options.seconds - (time.monotonic() - begin)
        report(learning, mark // options.batch, left)
        if learning.done < mark // options.batch:
            break
        write(options.model, mark, learning)
        with torch.no_grad(), learning.averages_in_place():
            told = ids[count:-1]
            print(f"left open, by step, told the prompt: {unexplained(told)}")
            print(f"left open, by step, told another:    {unexplained(told.roll(7, 0))}", flush=True)
    torch.save(learning.state(), checkpoint)


def write(model, mark, learning):
    """A folder with the averaged weights, which `wake` reads."""
    out = model.with_name(f"{model.name}-{mark}")
    shutil.copytree(model, out, dirs_exist_ok=True, ignore=shutil.ignore_patterns("checkpoints", "torch.pt", "*.jsonl", "sheet.png"))
    text, unet = learning.averaged()
    save_file({f"text_model.{name.removeprefix('text_model.')}": value for name, value in halves(text).items()}, out / TEXT)
    save_file(halves(unet), out / UNET)
    print(f"wrote {out}", flush=True)


def report(learning, steps, seconds):
    """Makes steps, for so many seconds at most."""
    begin, first = time.monotonic(), learning.done
    while learning.done < steps and time.monotonic() - begin < seconds:
        learning.step()
        if learning.done % 500 == 0 or learning.done == steps or learning.done == first + 10:
            value = learning.value.item()
            each = (time.monotonic() - begin) / (learning.done - first)
            print(f"step {learning.done} of {learning.steps}: loss {value:.5f}, {1000 * each:.2f} ms a step", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, help="folder that `wake train text-to-image` wrote")
    parser.add_argument("data", type=Path, help="data set of `wake dataset`")
    parser.add_argument("--images", type=int, default=40_000)
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--samples", default="80000,250000,500000,1000000", help="numbers of images seen that are written")
    parser.add_argument("--rate", type=float, default=5e-4)
    parser.add_argument("--uniform", action="store_true", help="train in the usual way: all steps are drawn alike, all errors count alike")
    parser.add_argument("--random-text", action="store_true", help="begin with random weights of the text encoder as well")
    parser.add_argument("--seconds", type=float, default=math.inf, help="stop after this time, to go on later")
    parser.add_argument("--bf16", action="store_true", help="compute losses in bfloat16; weights keep 32 bits")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True
    torch.backends.cudnn.benchmark = True
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    train(options, device)


if __name__ == "__main__":
    main()
