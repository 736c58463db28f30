import numpy as np

from gear.groundtruth.stray_pixels import without_strays


def body() -> np.ndarray:
    mask = np.zeros((60, 80), np.bool_)
    mask[10:50, 20:40] = True
    return mask


def test_a_mask_in_one_piece_is_kept() -> None:
    mask = body()[10:50, 20:40]
    kept, left, top = without_strays(mask)
    assert kept is mask and (left, top) == (0, 0)


def test_small_pieces_beyond_the_rest_are_left_out() -> None:
    mask = body()
    mask[30, 70:73] = True
    mask[0, 25] = True
    kept, left, top = without_strays(mask[0:50, 20:73])
    assert (left, top) == (0, 10) and kept.shape == (40, 20) and kept.all()


def test_small_pieces_inside_the_box_of_the_rest_are_kept() -> None:
    mask = body()
    mask[10:20, 20:30] = False
    mask[12, 22] = True
    kept, left, top = without_strays(mask[10:50, 20:40])
    assert (left, top) == (0, 0) and np.array_equal(kept, mask[10:50, 20:40])


def test_a_twentieth_of_the_pixels_is_stray_and_more_is_not() -> None:
    for rest, pixels, is_stray in ((800, 42, True), (800, 43, False), (760, 40, True)):
        mask = np.zeros((1, 1000), np.bool_)
        mask[0, :rest] = True
        mask[0, 900 : 900 + pixels] = True
        kept, _, _ = without_strays(mask[:, : 900 + pixels])
        assert (kept.shape[1] == rest) is is_stray


def test_pieces_that_touch_at_corners_are_one() -> None:
    mask = np.eye(100, dtype=np.bool_)
    mask[:60, :60] = True
    kept, _, _ = without_strays(mask)
    assert kept.shape == (100, 100)


def test_a_scattered_object_is_kept_whole() -> None:
    """Thirty leaves' gaps of one pixel each: none is more of the object than another."""
    mask = np.zeros((59, 59), np.bool_)
    mask[::2, ::2] = np.eye(30, dtype=np.bool_)
    kept, left, top = without_strays(mask)
    assert kept is mask and (left, top) == (0, 0)
