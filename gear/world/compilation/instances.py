"""Instances of assets inside a dm_control tree: bodies that share the meshes and materials of one attached file."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.values.errors import TownError
from gear.world.compilation.asset_prefetch import AssetPrefetcher
from gear.world.compilation.copies import Copy, put_copies_into
from gear.world.compilation.mujoco_errors import compile_problem, without_breaks
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.compilation.static_parts import UNNAMED, MeshPath, split_asset
from gear.world.surfaces.face_texture import FACE_SIZE_PX

_UNREAD = ("frame", "replicate", "attach")
"""What MuJoCo knows in a body, and dm_control does not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceNames:
    """A face that takes a patch, by its names in the composed MJCF.

    Attributes:
        asset: MJCF that it comes from.
        owner: body of the board or of the carrier.
        is_carried: whether the owner is an actor.
        geom, site: the face and its frame.
        neutral_material: the asset's own material, which says what the face looks like without a patch.
    """

    asset: str
    owner: str
    is_carried: bool
    geom: str
    site: str
    neutral_material: str


def load_mjcf(
    path: Path, text: str | None = None, mesh_paths: Mapping[str, MeshPath] | None = None
) -> mjcf.RootElement:
    """Reads one file; its model is named after the file and everything in it has a name.

    Args:
        path: of the file.
        text: what is read in its place.
        mesh_paths: files of the text that stay where they are.

    Raises:
        TownError: dm_control cannot read it.
    """
    try:
        if text is None:
            root = mjcf.from_path(str(path))
        else:
            root = mjcf.from_xml_string(text, model_dir=str(path.parent), assets=mesh_paths)
    except (KeyError, ValueError, OSError, AttributeError, SyntaxError, RecursionError) as error:
        if text is not None:
            load_mjcf(path)  # fails too, and its lines are those of the file
        if isinstance(error, KeyError):
            what = f"{error.args[0]} is not known here"
            if what.endswith(tuple(f"'{tag}' is not known here" for tag in _UNREAD)):
                what += "; write bodies where it says frame, replicate or attach"
        elif isinstance(error, (SyntaxError, RecursionError)):
            # The file itself is XML: it is one that it includes, which MuJoCo names.
            what = compile_problem(path) or without_breaks(error)
        else:
            what = without_breaks(error)
        raise TownError(path, f"cannot be read as MJCF: {what}") from error
    root.model = path.stem
    # Writing an element without a name makes dm_control count all elements before it: quadratic in their number.
    for tag in ("geom", "site", "body"):
        for index, element in enumerate(root.find_all(tag)):
            if getattr(element, "name", "") is None:
                element.name = f"{UNNAMED}{tag}_{index}"
    return root


def class_name(dclass: Any) -> str:
    """Of an element's default class: dm_control knows it, or has only its name, or there is none."""
    return dclass if isinstance(dclass, str) else "" if dclass is None else str(dclass.dclass)


def free_name(root: mjcf.RootElement, kind: str, name: str) -> str:
    """The name, or one like it where the town has something of that kind and name."""
    while root.find(kind, name) is not None:
        name += "_"
    return name


class AssetInstances:
    """The assets that a composition has taken in, each file once."""

    def __init__(self, root: mjcf.RootElement, prefetcher: AssetPrefetcher) -> None:
        self._root = root
        self._prefetcher = prefetcher
        self._turns = _turns_of(root)
        self._models: dict[Path, mjcf.RootElement] = {}
        self._textures: dict[tuple[str, ...], Any] = {}
        self._defaults: dict[str, str] = {}
        self._plates: dict[Path, list[tuple[str, list[Any]]]] = {}
        self._instances: Counter[Path] = Counter()
        self._originals: dict[Path, str] = {}
        self._copies: defaultdict[str, list[Copy]] = defaultdict(list)

    @property
    def files(self) -> tuple[Path, ...]:
        """Those that were taken in."""
        return tuple(self._models)

    def add_instance(self, path: Path, body: Any) -> None:
        """Fills `body` with an instance of the asset that shares everything; number plates are worn by turns.

        Raises:
            TownError: the file cannot be used, or its instance would have the name of something else in the world.
        """
        self._fill(path, body)
        self._originals.setdefault(path, body.name)

    def has_instance(self, path: Path) -> bool:
        """Whether there is one that others can be copied from."""
        return path in self._originals

    def copy_instance(self, path: Path, name: str) -> None:
        """As `add_instance` into a body of that name, but for dm_control: it is `put_copies_into` that writes it."""
        plates = {geom: plate.full_identifier for geom, plate in self._next_plates(path).items()}
        frame = self._model(path).full_identifier  # of the empty body that dm_control puts behind the first instance
        self._copies[frame].append(Copy(name=name, original=self._originals[path], plates=plates))

    def _fill(self, path: Path, body: Any) -> None:
        model = self._model(path)
        try:
            for child in model.worldbody.all_children():
                _copy(child, body, body.name)
        except ValueError as error:
            told = f"cannot be put into one world with the town as {body.name!r}: {without_breaks(error)}"
            raise TownError(path, told) from error
        for geom, plate in self._next_plates(path).items():
            self._root.find("geom", f"{body.name}_{geom}").mesh = plate

    def _next_plates(self, path: Path) -> dict[str, Any]:
        """Meshes that the next instance wears, by geom."""
        turn = self._instances[path]
        self._instances[path] += 1
        return {geom: plates[turn % len(plates)] for geom, plates in self._plates[path]}

    def add_surface_instance(self, path: Path, body: Any, *, is_carried: bool) -> FaceNames:
        """Fills `body` with an instance whose face has a texture of its own.

        Raises:
            TownError: the asset has not exactly one face, or the face has no material or no `surface` site.
        """
        self._fill(path, body)
        model = self._model(path)
        faces = [geom for geom in model.find_all("geom") if class_name(geom.dclass).endswith(".face")]
        if len(faces) != 1:
            raise TownError(path, f"must have one geom of a class ending in `.face` to bear a patch, has {len(faces)}")
        face = faces[0]
        if model.find("site", "surface") is None or face.material is None:
            raise TownError(path, f"face {face.name!r} needs a material, and a site `surface` in its middle")
        if isinstance(face.material, str):  # dm_control leaves what it does not find as it is written
            raise TownError(path, f"face {face.name!r} has the material {face.material!r}, which is not there")
        geom = self._root.find("geom", f"{body.name}_{face.name}")
        geom.material = self._own_material(face.material, geom.name)
        return FaceNames(
            asset=path.stem,
            owner=body.name,
            is_carried=is_carried,
            geom=geom.name,
            site=f"{body.name}_surface",
            neutral_material=face.material.full_identifier,
        )

    def drop_templates(self) -> None:
        """Removes the attached files' own bodies; only what the instances refer to stays."""
        for model in self._models.values():
            for child in list(model.worldbody.all_children()):
                child.remove()

    def put_copies_into(self, tree: ET.Element) -> None:
        """Writes the instances that went around dm_control into the MJCF that it has written."""
        for worldbody in tree.iterfind("worldbody"):
            put_copies_into(worldbody, self._copies)

    def put_defaults_into(self, xml: str) -> str:
        """MJCF with the default classes that went around dm_control, where it left room for them."""
        for name, defaults in self._defaults.items():
            before, room, after = xml.partition(f'<default class="{name}/"/>')
            assert room  # dm_control writes one for every file
            xml = before + defaults + after
        return xml

    def _model(self, path: Path) -> mjcf.RootElement:
        """The asset's file, attached when first asked for."""
        if path not in self._models:
            for other in self._models:
                if other.stem == path.stem:
                    raise TownError(path, f"has the name of {other}, which is in the same world; rename one of them")
            split = split_asset(path)
            self._prefetcher.prefetch(map(os.fsdecode, split.mesh_paths.values()))
            model = load_mjcf(path, split.text, split.mesh_paths)
            if _turns_of(model) != self._turns:
                told = "turns geoms by {} and the town by {}; write both with the same compiler setting"
                raise TownError(path, told.format(_turns_of(model), self._turns))
            if split.text is not None:
                self._defaults[model.model] = split.defaults
            try:
                self._root.attach(model)
            except ValueError as error:
                raise TownError(path, f"cannot be put into one world with the town: {error}") from error
            self._share_textures(model)
            self._models[path] = model
            self._plates[path] = list(_plates_of(model))
        return self._models[path]

    def _share_textures(self, model: mjcf.RootElement) -> None:
        """Lets a file's materials wear the textures that another file has brought already, picture for picture."""
        for texture in list(model.asset.texture):
            if texture.file is None:
                continue
            attributes = texture.get_attributes()
            picture = attributes.pop("file").get_vfs_filename()
            attributes.pop("name")
            key = (picture, *(f"{name}={value}" for name, value in sorted(attributes.items())))
            known = self._textures.setdefault(key, texture)
            if known is texture:
                continue
            for material in model.asset.material:
                for wearer in (material, *material.all_children()):
                    if getattr(wearer, "texture", None) is texture:
                        wearer.texture = known
            texture.remove()

    def _own_material(self, material: Any, name: str) -> Any:
        width, height = FACE_SIZE_PX
        texture = self._root.asset.add(
            "texture",
            name=free_name(self._root, "texture", name),
            type="2d",
            builtin="flat",
            colorspace="sRGB",
            width=width,
            height=height,
            rgb1=(1, 1, 1),
        )
        attributes = _attributes_outside(material)
        own_name = free_name(self._root, "material", name)
        attributes.update(name=own_name, texture=texture, rgba=(1.0, 1.0, 1.0, 1.0))
        own = self._root.asset.add("material", **attributes)
        for layer in material.all_children():
            layer_attributes = layer.get_attributes()
            if layer_attributes.get("role") == "rgb":
                layer_attributes["texture"] = texture
            own.add(layer.tag, **layer_attributes)
        return own


def _turns_of(model: mjcf.RootElement) -> str:
    """How a file writes its angles. One setting holds for the whole world, so that of one file, which another only
    lacks, would turn the other's geoms as well."""
    return f"angle={model.compiler.angle or 'degree'} eulerseq={model.compiler.eulerseq or 'xyz'}"


def _plates_of(model: mjcf.RootElement) -> Iterator[tuple[str, list[Any]]]:
    """Geoms of a class ending in `.plate`, and the meshes that they can wear: `m`, their own, `m_1`, `m_2` …"""
    for geom in model.find_all("geom"):
        if class_name(geom.dclass).endswith(".plate") and getattr(geom.mesh, "name", None):
            meshes = [geom.mesh]
            while (other := model.find("mesh", f"{geom.mesh.name}_{len(meshes)}")) is not None:
                meshes.append(other)
            yield geom.name, meshes


def _attributes_outside(element: Any) -> dict[str, Any]:
    """Attributes that mean the same in the tree that the element's file is attached to."""
    attributes: dict[str, Any] = element.get_attributes()
    for reference in ("dclass", "childclass"):
        if isinstance(attributes.get(reference), str):
            attributes[reference] = f"{element.root.model}/{attributes[reference]}"
    return attributes


def _copy(element: Any, parent: Any, prefix: str) -> None:
    attributes = _attributes_outside(element)
    attributes["name"] = f"{prefix}_{element.name}"
    copy = parent.add(element.tag, **attributes)
    if element.tag == "body":
        for child in element.all_children():
            if child.tag in ("body", "geom", "site"):
                _copy(child, copy, prefix)
