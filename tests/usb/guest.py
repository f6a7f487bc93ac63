# SPDX-License-Identifier: Apache-2.0
"""Runs commands in a small Linux in QEMU, with the emulated USB device behind a real kernel.

usbfs, usbcore, the host-controller driver (vhci_hcd), enumeration and unplugging are those of the kernel; the
device is `usbip_emulator`. The clock of the guest counts instructions, so its times do not depend on the load
of this machine. All files are in one initial file system. The guest returns its results over a serial line.
"""

from __future__ import annotations

import io
import lzma
import platform
import re
import shutil
import subprocess
import tarfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / "build" / "guest"
MODULES = ["common/usb-common", "core/usbcore", "usbip/usbip-core", "usbip/vhci-hcd"]
NEEDED = {
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "cpio": "cpio",
    "apt-get": "apt",
    "dpkg": "dpkg",
    "ldd": "libc-bin",
}
LONGEST_RUN_S = 1800
"""Longest time that the guest Linux may run in QEMU [s]"""
UNPRIVILEGED = "nobody"
"""User without rights"""


def missing() -> str:
    """Returns the names of missing packages, for the reason of a skipped test; empty if none is missing."""
    if platform.machine() != "x86_64":
        return f"needs a machine that is x86_64, not {platform.machine()}"
    missing_packages = [package for tool, package in NEEDED.items() if shutil.which(tool) is None]
    if missing_packages:
        return f"needs {' '.join(sorted(missing_packages))}"
    return "" if kernel() else "needs the package linux-image-amd64 from Debian's archive"


def kernel() -> Path | None:
    """Returns the unpacked kernel package, which is downloaded once and not installed."""
    place = CACHE / "kernel"
    if not place.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        listing = subprocess.run(
            ["apt-cache", "depends", "linux-image-amd64"], capture_output=True, text=True, check=False
        )
        found = re.search(r"Depends: (linux-image-\S+)", listing.stdout)
        if found is None:
            return None
        download = subprocess.run(
            ["apt-get", "-qq", "download", found[1]], cwd=CACHE, capture_output=True, check=False
        )
        package = next(CACHE.glob("linux-image-*.deb"), None)
        if download.returncode or package is None:
            return None
        subprocess.run(["dpkg", "-x", package, CACHE / "unpacking"], check=True)
        (CACHE / "unpacking").rename(place)
        package.unlink()
    return place if next((place / "boot").glob("vmlinuz-*"), None) else None


def libraries(program: Path) -> list[Path]:
    """Returns the paths of the shared libraries of a program."""
    output = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return [Path(path) for path in re.findall(r"(/\S+) \(0x", output)]


def install_module(driver: Path, folder: Path) -> None:
    """Copies a kernel driver; newer kernels store drivers compressed."""
    packed = Path(f"{driver}.xz")
    content = driver.read_bytes() if driver.exists() else lzma.decompress(packed.read_bytes())
    (folder / driver.name).write_bytes(content)


@dataclass
class GuestOutput:
    """Console text and returned files of one run of the guest Linux in QEMU."""

    console: str
    files: dict[str, str]
    """Text of each file in the folder /out of the guest Linux, by file name"""


def run(script: str, programs: dict[str, Path], files: dict[str, Path]) -> GuestOutput:
    """Boots the guest, runs a shell script in it and returns the files in /out.

    The `programs` are in /bin with their libraries, the `files` in /in. The script must write its results to
    files, because QEMU always ends with 0.
    """
    folder = CACHE / "work"
    shutil.rmtree(folder, ignore_errors=True)
    tree = folder / "tree"
    for name in ("bin", "dev", "etc", "in", "out", "proc", "sys", "tmp", "modules"):
        (tree / name).mkdir(parents=True)
    busybox = shutil.which("busybox")
    unpacked = kernel()
    assert busybox is not None
    assert unpacked is not None
    shutil.copy(busybox, tree / "bin" / "busybox")
    for name, program in programs.items():
        shutil.copy(program, tree / "bin" / name)
        for library in libraries(program):
            target = tree / library.relative_to("/")
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(library, target)
    for name, path in files.items():
        shutil.copy(path, tree / "in" / name)
    drivers = next((unpacked / "lib" / "modules").iterdir()) / "kernel" / "drivers" / "usb"
    for module in MODULES:
        install_module(drivers / f"{module}.ko", tree / "modules")
    load_modules = "\n".join(f"insmod /modules/{Path(module).name}.ko" for module in MODULES)
    (tree / "etc" / "passwd").write_text(f"root:x:0:0::/:/bin/sh\n{UNPRIVILEGED}:x:65534:65534::/:/bin/sh\n")
    init = tree / "init"
    commands = [
        "#!/bin/busybox sh",
        "/bin/busybox --install -s /bin",
        "export PATH=/bin",
        "mount -t proc proc /proc",
        "mount -t sysfs sysfs /sys",
        "mount -t devtmpfs devtmpfs /dev",
        load_modules,
        "mkdir -p /dev/bus/usb",
        "cd /out",
        script,
        "dmesg > /out/dmesg",
        "stty raw -F /dev/ttyS1",
        "tar -c -C /out . | gzip > /dev/ttyS1",
        "poweroff -f",
        "",
    ]
    init.write_text("\n".join(commands))
    init.chmod(0o755)
    image, results = folder / "initramfs", folder / "out.tar.gz"
    with image.open("wb") as archive:
        names = subprocess.run(["find", "."], cwd=tree, capture_output=True, check=True).stdout
        subprocess.run(
            ["cpio", "--quiet", "-o", "-H", "newc"], cwd=tree, input=names, stdout=archive, check=True
        )
    boot = next((unpacked / "boot").glob("vmlinuz-*"))
    machine = ["-accel", "tcg", "-smp", "1", "-icount", "shift=1,sleep=off,align=off", "-m", "256"]
    display = ["-nographic", "-no-reboot", "-monitor", "none"]
    lines = ["-serial", "stdio", "-serial", f"file:{results}"]
    kernel_options = ["-kernel", str(boot), "-initrd", str(image), "-append", "console=ttyS0 quiet panic=-1"]
    process = subprocess.run(
        ["qemu-system-x86_64", *machine, *display, *lines, *kernel_options],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=True,
        timeout=LONGEST_RUN_S,
    )
    returned: dict[str, str] = {}
    try:
        with tarfile.open(fileobj=io.BytesIO(results.read_bytes())) as archive:
            for member in archive:
                content = archive.extractfile(member)
                if content is not None:
                    returned[member.name.removeprefix("./")] = content.read().decode(errors="replace")
    except tarfile.TarError:
        pass  # the guest Linux ended too early; the text of its console shows the reason
    return GuestOutput(process.stdout, returned)
