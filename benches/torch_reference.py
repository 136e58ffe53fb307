"""What the benches measure, in PyTorch: run it on the same machine, at the same time of day.

    pip install torch diffusers transformers peft
    python benches/torch_reference.py [quick | training | fine-tune | device]

f32, random weights, as many threads as cores; seconds, median of the runs after one to warm up. `quick` leaves
out Stable Diffusion's U-Net and decoder. `device` measures on DEVICE (cuda) what `wake bench --part device` does. `fine-tune` makes steps of fine-tuning at the size of Stable Diffusion v1.4, as
`crates/wake-train/src/fine_tune/full_size.rs` does with the same variables of the environment.
"""

import os
import resource
import statistics
import sys
import time

import torch
import torch.nn.functional as F
from diffusers import AutoencoderKL, UNet2DConditionModel
from diffusers.models.resnet import Downsample2D, ResnetBlock2D, Upsample2D
from diffusers.models.transformers.transformer_2d import Transformer2DModel
from transformers import CLIPTextConfig, CLIPTextModel


def measure(name, call, runs):
    with torch.no_grad():
        call()
        seconds, busy = [], time.process_time()
        for _ in range(runs):
            begin = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - begin)
    work = (time.process_time() - busy) / runs
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(f"{name:45} {statistics.median(seconds):10.4f} s, {work:.4f} s of all cores   peak {peak} MiB", flush=True)


def blocks():
    for batch, channels, size in [(2, 320, 64), (4, 64, 32), (2, 128, 16), (2, 192, 8)]:
        block = ResnetBlock2D(in_channels=channels, temb_channels=4 * channels, groups=32, eps=1e-5).eval()
        x, time_embedding = torch.randn(batch, channels, size, size), torch.randn(batch, 4 * channels)
        measure(f"residual_block {batch}x{channels}x{size}x{size}", lambda: block(x, time_embedding), 20)
    for tokens, inner, outer in [(4096, 320, 320), (4096, 320, 2560), (1024, 2560, 640), (256, 1280, 10240)]:
        layer, x = torch.nn.Linear(inner, outer), torch.randn(1, tokens, inner)
        measure(f"linear layer, {tokens} tokens x {inner} to {outer}", lambda: layer(x), 20)
    query = torch.randn(1, 8, 4096, 40)
    for tokens in (4096, 77):
        context = torch.randn(1, 8, tokens, 40)
        measure(
            f"attention 8 heads of 40, 4096x{tokens}",
            lambda: F.scaled_dot_product_attention(query, context, context),
            10,
        )


def training(name, model, inputs):
    """Forward, and forward with gradients."""
    measure(f"{name}, forward", lambda: model(*inputs), 7)
    def step():
        with torch.enable_grad():
            out = model(*inputs)
            (out if torch.is_tensor(out) else out.sample).square().mean().backward()
    measure(f"{name}, with gradients", step, 7)


class Block(torch.nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.norms = torch.nn.ModuleList(torch.nn.GroupNorm(16, channels) for _ in range(2))
        self.convs = torch.nn.ModuleList(torch.nn.Conv2d(channels, channels, 3, padding=1) for _ in range(2))

    def forward(self, x):
        h = x
        for norm, conv in zip(self.norms, self.convs):
            h = conv(F.silu(norm(h)))
        return x + h


def trainings():
    for batch, channels, size in [(16, 64, 32), (16, 128, 16), (16, 192, 8), (1, 64, 32)]:
        blocks = torch.nn.Sequential(Block(channels), Block(channels))
        training(f"training: b{batch} c{channels} s{size}", blocks, [torch.randn(batch, channels, size, size)])
    inputs = [torch.randn(16, 16, 32, 32), 500, torch.randn(16, 77, 256)]
    training("training: small U-Net, batch 16", UNet2DConditionModel(**SMALL), inputs)


def fine_tune():
    """Encoding, text and one step of AdamW on the noise of the latents."""
    side, batch, rank = (int(os.environ.get(name, default)) for name, default in [("SIDE", 512), ("BATCH", 1), ("RANK", 0)])
    text = text_encoder().requires_grad_(False).to(DEVICE)
    vae = decoder().requires_grad_(False).to(DEVICE)
    model = UNet2DConditionModel(cross_attention_dim=768, attention_head_dim=8).train().to(DEVICE)
    if rank:
        from peft import LoraConfig

        model.requires_grad_(False)
        model.add_adapter(LoraConfig(r=rank, lora_alpha=rank, target_modules=["to_k", "to_q", "to_v", "to_out.0"]))
    if "CHECKPOINTING" in os.environ:
        model.enable_gradient_checkpointing()
    bf16 = torch.autocast(DEVICE, torch.bfloat16, enabled="BF16" in os.environ)
    learning = [p for p in model.parameters() if p.requires_grad]
    optimizer = torch.optim.AdamW(learning, lr=1e-5)
    ids, images = torch.arange(77).repeat(batch, 1).to(DEVICE), 0.2 * torch.randn(batch, 3, side, side, device=DEVICE)
    for step in range(1, 1 + int(os.environ.get("STEPS", 2))):
        begin = time.perf_counter()
        with torch.no_grad():
            latents = vae.encode(images).latent_dist.sample() * 0.18215
            context = text(ids).last_hidden_state
        noise, steps = torch.randn_like(latents), torch.randint(0, 1000, (batch,), device=DEVICE)
        with bf16:
            found = model(latents + noise, steps, context).sample
            loss = F.mse_loss(found.float(), noise)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(learning, 1.0)
        optimizer.step()
        optimizer.zero_grad()
        synchronise()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024e-9
        if DEVICE != "cpu":
            peak = torch.cuda.max_memory_allocated() * 1e-9
        print(f"step {step}: {time.perf_counter() - begin:.2f} s, loss {loss.item():.4f}, peak {peak:.2f} GB", flush=True)


def on_device():
    """What `wake bench --part device` measures, without gradients."""
    normal = lambda *shape: torch.randn(shape)
    rows = [(f"residual block, 2 x {c} x {s}^2", residual(c), (normal(2, c, s, s), normal(2, 1280)), 10)
            for c, s in [(320, 64), (640, 32), (1280, 16), (1280, 8)]]
    rows += [(f"transformer, 2 x {c} x {s}^2",
              Transformer2DModel(8, c // 8, c, norm_num_groups=32, cross_attention_dim=768).eval(),
              (normal(2, c, s, s), normal(2, 77, 768)), 10) for c, s in [(320, 64), (640, 32), (1280, 16)]]
    rows += [(f"attention, 8 heads of 40, 4096 x {n}", torch.nn.Identity(), (normal(1, 8, 4096, 40), normal(1, 8, n, 40)), 10)
             for n in (4096, 77)]
    rows += [
        ("half the size, 2 x 320 x 64^2", Downsample2D(320, use_conv=True), (normal(2, 320, 64, 64),), 10),
        ("twice the size, 2 x 640 x 32^2", Upsample2D(640, use_conv=True), (normal(2, 640, 32, 32),), 10),
        ("decoder's residual block, 1 x 256 x 256^2", residual(256, None), (normal(1, 256, 256, 256), None), 5),
        ("decoder to 512 x 512", Call(decoder(), "decode"), (normal(1, 4, 64, 64),), 3),
        ("encoder of 512 x 512", Call(decoder(), "encode"), (normal(1, 3, 512, 512),), 3),
        ("text encoder, batch 2", text_encoder(), (torch.full((2, 77), 320),), 5),
        ("Stable Diffusion's U-Net, batch 2, 64^2", UNet2DConditionModel(cross_attention_dim=768, attention_head_dim=8).eval(),
         (normal(2, 4, 64, 64), 500, normal(2, 77, 768)), 3),
        ("small U-Net, batch 2, 32^2", UNet2DConditionModel(**SMALL).eval(), (normal(2, 16, 32, 32), 500, normal(2, 77, 256)), 10),
    ]
    for name, model, inputs, runs in rows:
        line = f"{name:45}"
        for dtype in (torch.float32, torch.float16, torch.bfloat16):
            there = model.to(DEVICE, dtype)
            given = [to_device(x, dtype) for x in inputs]
            def call():
                if name.startswith("attention"):
                    return F.scaled_dot_product_attention(given[0], given[1], given[1])
                return there(*given)
            seconds = []
            with torch.no_grad():
                for run in range(runs + 2):
                    synchronise()
                    begin = time.perf_counter()
                    call()
                    synchronise()
                    seconds.append(time.perf_counter() - begin)
            line += f" {1e3 * statistics.median(seconds[2:]):9.2f} ms"
        print(line, flush=True)


def residual(channels, time_channels=1280):
    return ResnetBlock2D(in_channels=channels, temb_channels=time_channels, groups=32, eps=1e-5).eval()


def to_device(x, dtype):
    if not torch.is_tensor(x):
        return x
    return x.to(DEVICE, dtype) if x.is_floating_point() else x.to(DEVICE)


class Call(torch.nn.Module):
    """A method of a model as a module."""

    def __init__(self, model, method):
        super().__init__()
        self.model, self.method = model, method

    def forward(self, *inputs):
        return getattr(self.model, self.method)(*inputs)


def synchronise():
    if DEVICE != "cpu":
        torch.cuda.synchronize()


def text_encoder():
    return CLIPTextModel(
        CLIPTextConfig(hidden_size=768, intermediate_size=3072, num_hidden_layers=12, num_attention_heads=12)
    ).eval()


def decoder():
    return AutoencoderKL(
        block_out_channels=(128, 256, 512, 512),
        down_block_types=("DownEncoderBlock2D",) * 4,
        up_block_types=("UpDecoderBlock2D",) * 4,
        layers_per_block=2,
        latent_channels=4,
    ).eval()


def unet(name, batch, size, runs, **config):
    model = UNet2DConditionModel(**config).eval()
    channels, width = config.get("in_channels", 4), config["cross_attention_dim"]
    sample, context = torch.randn(batch, channels, size, size), torch.randn(batch, 77, width)
    measure(name, lambda: model(sample, 500, context), runs)


DEVICE = os.environ.get("DEVICE", "cuda" if "device" in sys.argv else "cpu")
SMALL = {
    "in_channels": 16,
    "out_channels": 16,
    "block_out_channels": (64, 128, 192),
    "layers_per_block": 1,
    "attention_head_dim": (4, 4, 6),
    "cross_attention_dim": 256,
    "norm_num_groups": 16,
    "down_block_types": ("DownBlock2D", "CrossAttnDownBlock2D", "CrossAttnDownBlock2D"),
    "up_block_types": ("CrossAttnUpBlock2D", "CrossAttnUpBlock2D", "UpBlock2D"),
}


def main():
    torch.set_num_threads(os.cpu_count())
    print(f"torch {torch.__version__}, {torch.get_num_threads()} threads")
    if "fine-tune" in sys.argv:
        return fine_tune()
    if "device" in sys.argv:
        return on_device()
    trainings()
    if "training" in sys.argv:
        return
    blocks()
    for batch in (1, 2):
        unet(f"small U-Net 32x32, batch {batch}", batch, 32, 20, **SMALL)
    text = text_encoder()
    ids = torch.full((2, 77), 320)
    measure("text encoder, batch 2", lambda: text(ids), 5)
    if "quick" in sys.argv:
        return
    vae = decoder()
    latents = torch.randn(1, 4, 64, 64)
    measure("decoder to 512x512", lambda: vae.decode(latents), 3)
    del vae
    unet("stable-diffusion U-Net, batch 2, 64x64", 2, 64, 3, cross_attention_dim=768, attention_head_dim=8)


if __name__ == "__main__":
    main()
