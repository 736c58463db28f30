"""Compresses bytes that are given as runs of equal bytes to a zlib stream.

A general compressor reads every byte. Here each run is encoded as one literal and DEFLATE copies of it, with one
Huffman code for the whole stream. The time depends on the number of runs instead of the number of bytes, and the result
does not depend on the processor.
"""

from __future__ import annotations

import heapq
import struct

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]

_LONGEST_COPY, _SHORTEST_COPY = 258, 3
_END, _FIRST_COPY, _SYMBOLS = 256, 257, 286
_MAX_CODE_BITS = 15
_ADLER = 65521
_LENGTH_ORDER = (16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15)
"""Order in which a dynamic block stores the lengths of the code length codes (RFC 1951, section 3.2.7)."""


def _copy_symbols() -> tuple[Ints, Ints, Ints]:
    """For copies of 0..258 bytes: the symbol, the number of its extra bits, and their value."""
    symbol, bits, value = (np.zeros(_LONGEST_COPY + 1, np.int64) for _ in range(3))
    length = _SHORTEST_COPY
    for number in range(_FIRST_COPY, _SYMBOLS - 1):
        extra = max(0, (number - _FIRST_COPY) // 4 - 1)
        for low in range(min(1 << extra, _LONGEST_COPY - length)):
            symbol[length + low], bits[length + low], value[length + low] = number, extra, low
        length += 1 << extra
    symbol[_LONGEST_COPY] = _SYMBOLS - 1
    return symbol, bits, value


_COPY_SYMBOL, _COPY_BITS, _COPY_VALUE = _copy_symbols()


def compress(values: npt.NDArray[np.uint8], lengths: Ints) -> bytes:
    """Compresses runs of equal bytes to a zlib stream.

    Args:
        values: (N,) value of the bytes in each run.
        lengths: (N,) number of bytes in each run, at least 1.
    """
    wide = values.astype(np.int64)
    ends = np.cumsum(lengths)
    size = int(ends[-1])
    # Adler's second sum weighs each byte with how many follow it, itself included.
    weights = (lengths * (size - ends) + lengths * (lengths + 1) // 2) % _ADLER
    first = (1 + int((wide * lengths).sum())) % _ADLER
    second = (size + int((wide * weights).sum())) % _ADLER
    return b"\x78\x01" + _block(wide, lengths) + struct.pack(">I", second << 16 | first)


def _block(values: Ints, lengths: Ints) -> bytes:
    """A single, final DEFLATE block with a dynamic Huffman code."""
    symbols, extra_bits, extra = _tokens(values, lengths)
    code_bits = _code_lengths(np.bincount(symbols, minlength=_SYMBOLS))
    # Head: last block, own codes, 286 symbols, one distance, 19 lengths of lengths: four bits each for 0..15.
    head = [(1, 1), (2, 2), (_SYMBOLS - 257, 5), (0, 5), (15, 4)]
    head += [(4 if number < 16 else 0, 3) for number in _LENGTH_ORDER]
    head += [(_reversed(number, 4), 4) for number in (*code_bits.tolist(), 1)]
    head_values, head_bits = np.array(head, np.int64).T
    token_bits = code_bits[symbols]
    content = _canonical(code_bits)[symbols] | extra << token_bits
    # Copies reach back by one byte, for which one bit stands, a zero.
    token_bits += extra_bits + (symbols >= _FIRST_COPY)
    return _packed(np.concatenate([head_values, content]), np.concatenate([head_bits, token_bits]))


def _tokens(values: Ints, lengths: Ints) -> tuple[Ints, Ints, Ints]:
    """Symbols with the number and the value of their extra bits: for each run its literal, then its copies; the end
    symbol is last.
    """
    whole, rest = np.divmod(lengths - 1, _LONGEST_COPY)
    is_copy = rest >= _SHORTEST_COPY
    last = np.cumsum(1 + whole + np.where(is_copy, 1, rest)) - 1
    symbols = np.full(int(last[-1]) + 2, _SYMBOLS - 1)
    extra_bits, extra = np.zeros_like(symbols), np.zeros_like(symbols)
    # What is left of a run is one shorter copy, or its byte once or twice more.
    short, left = last[is_copy], rest[is_copy]
    symbols[short], extra_bits[short], extra[short] = _COPY_SYMBOL[left], _COPY_BITS[left], _COPY_VALUE[left]
    for again in (1, 2):
        more = ~is_copy & (rest >= again)
        symbols[last[more] - (again - 1)] = values[more]
    symbols[np.append(0, last[:-1] + 1)] = values
    symbols[-1] = _END
    return symbols, extra_bits, extra


def _code_lengths(counts: Ints) -> Ints:
    """Huffman code length of each symbol in bits, up to DEFLATE's limit; 0 for symbols that do not occur."""
    used = np.flatnonzero(counts)
    while True:
        # Nodes are numbered as they are made: the leaves, what joins them, the root last.
        heap = list(zip(counts[used].tolist(), range(len(used)), strict=True))
        heapq.heapify(heap)
        parent = list(range(max(2 * len(used) - 1, 2)))
        for node in range(len(used), 2 * len(used) - 1):
            (one_count, one), (other_count, other) = heapq.heappop(heap), heapq.heappop(heap)
            parent[one] = parent[other] = node
            heapq.heappush(heap, (one_count + other_count, node))
        depth = [0] * len(parent)
        for node in reversed(range(len(parent) - 1)):
            depth[node] = depth[parent[node]] + 1
        lengths = np.zeros(len(counts), np.int64)
        # A symbol that is alone still takes a bit.
        lengths[used] = np.maximum(depth[: len(used)], 1)
        if int(lengths.max()) <= _MAX_CODE_BITS:
            return lengths
        # Flatter counts make a flatter tree.
        counts = (counts + 1) // 2


def _canonical(lengths: Ints) -> Ints:
    """DEFLATE's canonical code of each symbol, with the first bit as the least significant."""
    codes = np.zeros_like(lengths)
    code = 0
    for bits in range(1, _MAX_CODE_BITS + 1):
        code <<= 1
        members = np.flatnonzero(lengths == bits)
        codes[members] = [_reversed(code + number, bits) for number in range(len(members))]
        code += len(members)
    return codes


def _reversed(code: int, bits: int) -> int:
    return int(f"{code:0{bits}b}"[::-1], 2)


def _packed(values: Ints, bits: Ints) -> bytes:
    """Packs values, each with its number of bits (1 to 32), into bytes, least significant bits first."""
    ends = np.cumsum(bits)
    starts = ends - bits
    word = starts >> 5
    shifted = values << (starts & 31)
    # Every word of 32 bits has a beginning in it, since no value is longer.
    first = np.flatnonzero(np.diff(word, prepend=-1))
    sums = np.bitwise_or.reduceat(shifted, first)
    words = np.append(sums & 0xFFFFFFFF, 0)
    words[1:] |= sums >> 32
    return words.astype("<u4").tobytes()[: (int(ends[-1]) + 7) // 8]
