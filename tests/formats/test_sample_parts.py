from gear.formats.sample_parts import column_of, parts


def test_names_are_folders_with_the_end_where_a_folder_holds_several_files() -> None:
    city = "city_000003_000000"
    found = parts(
        [f"leftImg8bit/val/city/{city}_leftImg8bit.png", f"gtFine/val/city/{city}_gtFine_labelIds.png",
         f"gtFine/val/city/{city}_gtFine_labelTrainIds.png", f"gtFine/val/city/{city}_gtFine_polygons.json"],
        "val",
    )  # fmt: skip
    assert [(part.name, part.suffix, part.glob) for part in found] == [
        ("gtfine_labelids", "png", "gtFine/val/city/*_labelIds.png"),
        ("gtfine_labeltrainids", "png", "gtFine/val/city/*_labelTrainIds.png"),
        ("gtfine_polygons", "json", "gtFine/val/city/*_polygons.json"),
        ("leftimg8bit", "png", "leftImg8bit/val/city/*.png"),
    ]


def test_files_of_one_name_are_distinguished_by_their_suffix() -> None:
    found = parts(["gtFine/val/rgb_0001.png", "gtFine/val/rgb_0001.tiff"], "val")
    assert [(part.name, part.suffix) for part in found] == [("gtfine", "png"), ("gtfine", "tiff")]
    names = {(part.name, part.suffix) for part in found} | {("image", "png")}
    assert column_of("gtfine", "tiff", names) == "gtfine_tiff"
    assert column_of("image", "png", names) == "image"


def test_deeper_folders_count_where_the_first_is_not_enough() -> None:
    found = parts(["data/val/Left-1/0001.png", "data/val/Right-1/0001.png"], "val")
    assert [part.name for part in found] == ["data_left_1", "data_right_1"]
    assert [part.name for part in parts(["0001.png"], "val")] == ["file"]
