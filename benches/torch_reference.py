"""What the benches measure, in PyTorch: run it on the same machine, at the same time of day.

    pip install torch diffusers transformers peft
    python benches/torch_reference.py [quick | training | fine-tune]

f32, random weights, as many threads as cores; seconds, median of the runs after one to warm up. `quick` leaves
out Stable Diffusion's U-Net and decoder. `fine-tune` makes steps of fine-tuning at the size of Stable Diffusion v1.4, as
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
from diffusers.models.resnet import ResnetBlock2D
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
    text = CLIPTextModel(
        CLIPTextConfig(hidden_size=768, intermediate_size=3072, num_hidden_layers=12, num_attention_heads=12)
    ).requires_grad_(False)
    vae = decoder().requires_grad_(False)
    model = UNet2DConditionModel(cross_attention_dim=768, attention_head_dim=8).train()
    if rank:
        from peft import LoraConfig

        model.requires_grad_(False)
        model.add_adapter(LoraConfig(r=rank, lora_alpha=rank, target_modules=["to_k", "to_q", "to_v", "to_out.0"]))
    if "CHECKPOINTING" in os.environ:
        model.enable_gradient_checkpointing()
    bf16 = torch.autocast("cpu", torch.bfloat16, enabled="BF16" in os.environ)
    learning = [p for p in model.parameters() if p.requires_grad]
    optimizer = torch.optim.AdamW(learning, lr=1e-5)
    ids, images = torch.arange(77).repeat(batch, 1), 0.2 * torch.randn(batch, 3, side, side)
    for step in range(1, 1 + int(os.environ.get("STEPS", 2))):
        begin = time.perf_counter()
        with torch.no_grad():
            latents = vae.encode(images).latent_dist.sample() * 0.18215
            context = text(ids).last_hidden_state
        noise, steps = torch.randn_like(latents), torch.randint(0, 1000, (batch,))
        with bf16:
            found = model(latents + noise, steps, context).sample
            loss = F.mse_loss(found.float(), noise)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(learning, 1.0)
        optimizer.step()
        optimizer.zero_grad()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024e-9
        print(f"step {step}: {time.perf_counter() - begin:.1f} s, loss {loss.item():.4f}, peak {peak:.2f} GB", flush=True)


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
    trainings()
    if "training" in sys.argv:
        return
    blocks()
    for batch in (1, 2):
        unet(f"small U-Net 32x32, batch {batch}", batch, 32, 20, **SMALL)
    text = CLIPTextModel(
        CLIPTextConfig(hidden_size=768, intermediate_size=3072, num_hidden_layers=12, num_attention_heads=12)
    ).eval()
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
