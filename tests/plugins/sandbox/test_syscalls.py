"""The filter of system calls, run step by step as the kernel does; the kernel itself runs it in test_sandbox."""

import errno
import socket
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.sandbox.syscalls import filter_program

ALLOWED, KILLED = 0x7FFF0000, 0x80000000
REFUSED = 0x00050000
X86_64, AARCH64, I386 = 0xC000003E, 0xC00000B7, 0x40000003
SOCKET = {X86_64: 41, AARCH64: 198}
CLONE = {X86_64: 56, AARCH64: 220}
MACHINES = {X86_64: "x86_64", AARCH64: "aarch64"}


def decide(program: bytes, architecture: int, number: int, *arguments: int) -> int:
    """Return what the program says to a call (the instructions that it uses of linux/bpf_common.h)."""
    padded = [*arguments, *[0] * (6 - len(arguments))]
    data = struct.pack("=iIQ6Q", number, architecture, 0, *padded)
    steps = list(struct.iter_unpack("=HBBI", program))
    at, register = 0, 0
    while True:
        code, if_true, if_false, value = steps[at]
        at += 1
        match code:
            case 0x20:
                (register,) = struct.unpack_from("=I", data, value)
            case 0x15:
                at += if_true if register == value else if_false
            case 0x35:
                at += if_true if register >= value else if_false
            case 0x45:
                at += if_true if register & value else if_false
            case 0x06:
                return int(value)
            case _:
                raise AssertionError(f"unknown instruction {code:#x}")


@pytest.mark.parametrize("architecture", MACHINES)
def test_only_unix_sockets_and_no_namespaces(architecture: int) -> None:
    program = filter_program(MACHINES[architecture])

    assert decide(program, architecture, SOCKET[architecture], socket.AF_UNIX) == ALLOWED
    for family in {int(family) for family in socket.AddressFamily} - {socket.AF_UNIX}:
        assert decide(program, architecture, SOCKET[architecture], family) == REFUSED | errno.EACCES
    assert decide(program, architecture, CLONE[architecture], 0x01200011) == ALLOWED
    for flag in (0x10000000, 0x20000, 0x20000000, 0x40000000, 0x80):
        assert decide(program, architecture, CLONE[architecture], 0x11 | flag) == REFUSED | errno.EPERM
    assert decide(program, architecture, 435, 0) == REFUSED | errno.ENOSYS
    assert decide(program, architecture, 425, 0) == REFUSED | errno.EPERM


@given(st.sampled_from(sorted(MACHINES)), st.integers(0, 2**31 - 1), st.lists(st.integers(0, 2**64 - 1), max_size=6))
def test_every_call_gets_an_answer_and_none_under_another_name(
    architecture: int, number: int, arguments: list[int]
) -> None:
    program = filter_program(MACHINES[architecture])

    said = decide(program, architecture, number, *arguments)

    assert said == ALLOWED or said & 0xFFFF0000 == REFUSED
    assert decide(program, I386, number, *arguments) == KILLED
    if architecture == X86_64:
        assert decide(program, architecture, number | 0x40000000, *arguments) == REFUSED | errno.ENOSYS


def test_an_unknown_machine_gets_no_sandbox() -> None:
    with pytest.raises(BenchbotError, match="no sandbox for machines of the kind 'riscv64'"):
        filter_program("riscv64")
