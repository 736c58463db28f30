"""Instances of assets in a dm_control tree: bodies that share the meshes and materials of one attached file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gear.values.errors import TownError
from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation import quiet_mjcf
from gear.world.compilation.copies import Copy, put_copies_into
from gear.world.compilation.mujoco_errors import compile_problem, without_breaks
from gear.world.compilation.static_parts import UNNAMED, MeshPath, SplitAsset
from gear.world.surfaces.face_texture import FACE_SIZE_PX

if TYPE_CHECKING:
    from gear.world.compilation.quiet_mjcf import mjcf

_UNREAD = ("frame", "replicate", "attach")
"""Child elements of a body that MuJoCo can read and dm_control cannot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceNames:
    """The names, in the composed MJCF, of the elements of one face that can show a patch.

    Attributes:
        asset: name of the MJCF file that contains the face, without suffix.
        owner: name of the body of the board, or of the actor that carries the face.
        is_carried: whether the owner is an actor.
        geom, site: names of the geom of the face and of the site that defines its frame.
        neutral_material: name of the asset's own material, which the face shows without a patch.
    """

    asset: str
    owner: str
    is_carried: bool
    geom: str
    site: str
    neutral_material: str


def load_mjcf(
    path: Path, text: str | None = None, mesh_paths: Mapping[str, MeshPath] | None = None, name: str | None = None
) -> mjcf.RootElement:
    """Reads one MJCF file into dm_control, and gives a name to every element.

    Args:
        path: path of the file.
        text: MJCF text that is read instead of the file; None reads the file.
        mesh_paths: path of each mesh file, by its name in `text`.
        name: name of the model; None for the file's name without suffix.

    Raises:
        TownError: dm_control cannot read the file.
    """
    try:
        if text is None:
            root = quiet_mjcf.mjcf.from_path(str(path))
        else:
            root = quiet_mjcf.mjcf.from_xml_string(text, model_dir=str(path.parent), assets=mesh_paths)
    except (KeyError, ValueError, OSError, AttributeError, SyntaxError, RecursionError) as error:
        if text is not None:
            load_mjcf(path)  # raises the same error with the file's line numbers
        if isinstance(error, KeyError):
            what = f"{error.args[0]} is not known here"
            if what.endswith(tuple(f"'{tag}' is not known here" for tag in _UNREAD)):
                what += "; write bodies where it says frame, replicate or attach"
        elif isinstance(error, (SyntaxError, RecursionError)):
            # The file itself is XML, so the error is in a file that it includes, which MuJoCo names.
            what = compile_problem(path) or without_breaks(error)
        else:
            what = without_breaks(error)
        raise TownError(path, f"cannot be read as MJCF: {what}") from error
    root.model = name or path.stem
    # For each element without a name dm_control would count all earlier elements, in quadratic time.
    for tag in ("geom", "site", "body"):
        for index, element in enumerate(root.find_all(tag)):
            if getattr(element, "name", "") is None:
                element.name = f"{UNNAMED}{tag}_{index}"
    return root


def class_name(dclass: Any) -> str:
    """The name of an element's default class; "" if the element has no class.

    Args:
        dclass: dm_control's attribute `dclass`: the class, the name of a class that dm_control does not know, or None.
    """
    return dclass if isinstance(dclass, str) else "" if dclass is None else str(dclass.dclass)


def free_name(root: mjcf.RootElement, kind: str, name: str) -> str:
    """A name that no element of this kind has in the tree.

    Args:
        root: the tree.
        kind: tag of the element, such as `texture` or `material`.
        name: the name to begin with.

    Returns:
        `name`; with underscores appended if another element already has it.
    """
    while root.find(kind, name) is not None:
        name += "_"
    return name


class AssetInstances:
    """Makes instances of assets in a composition; the file of each asset is attached once."""

    def __init__(self, root: mjcf.RootElement, files: Mapping[AssetFile, SplitAsset]) -> None:
        """Makes an object that adds instances to one composed world.

        Args:
            root: MJCF tree of the town, to which instances are added.
            files: MJCF of each asset, by its file.
        """
        self._root = root
        self._files = files
        self._angles = _angle_settings(root)
        self._models: dict[AssetFile, mjcf.RootElement] = {}
        self._textures: dict[tuple[str, ...], Any] = {}
        self._defaults: dict[str, str] = {}
        self._plates: dict[AssetFile, list[tuple[str, list[Any]]]] = {}
        self._instances: Counter[AssetFile] = Counter()
        self._originals: dict[AssetFile, str] = {}
        self._copies: defaultdict[str, list[Copy]] = defaultdict(list)

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of the attached MJCF files, in the order in which they were attached."""
        return tuple(file.path for file in self._models)

    def add_instance(self, file: AssetFile, body: Any) -> None:
        """Adds an instance of an asset to a body. The instance shares meshes and materials with all other
        instances of the asset.

        The instances of an asset use the number plates in its file in turn.

        Args:
            file: file of the asset.
            body: dm_control's empty body in the town's tree; its name becomes the prefix of the names of the instance's
                elements.

        Raises:
            TownError: the file cannot be attached, or another element already has the name of the instance.
        """
        self._fill(file, body)
        self._originals.setdefault(file, body.name)

    def has_instance(self, file: AssetFile) -> bool:
        """Whether the asset has an instance that `copy_instance` can copy, made by `add_instance`.

        Args:
            file: file of the asset.
        """
        return file in self._originals

    def copy_instance(self, file: AssetFile, name: str) -> None:
        """Requests a copy of an asset's first instance, in a body with the given name. `put_copies_into` writes
        the copy later, without dm_control.

        Args:
            file: file of an asset for which `has_instance` is True.
            name: name of the copy's body.
        """
        plates = {geom: plate.full_identifier for geom, plate in self._next_plates(file).items()}
        frame = self._model(file).full_identifier  # names the empty body that dm_control puts after the first instance
        self._copies[frame].append(Copy(name=name, original=self._originals[file], plates=plates))

    def _fill(self, file: AssetFile, body: Any) -> None:
        model = self._model(file)
        try:
            for child in model.worldbody.all_children():
                _copy(child, body, body.name)
        except ValueError as error:
            problem = f"cannot be put into one world with the town as {body.name!r}: {without_breaks(error)}"
            raise TownError(file.path, problem) from error
        for geom, plate in self._next_plates(file).items():
            self._root.find("geom", f"{body.name}_{geom}").mesh = plate

    def _next_plates(self, file: AssetFile) -> dict[str, Any]:
        """Meshes of the number plates of the next instance, by the name of the geom."""
        number = self._instances[file]
        self._instances[file] += 1
        return {geom: plates[number % len(plates)] for geom, plates in self._plates[file]}

    def add_surface_instance(self, file: AssetFile, body: Any, *, is_carried: bool) -> FaceNames:
        """Adds an instance of an asset to a body. Its face gets a texture of its own, so that it can show a patch.

        Args:
            file: file of the asset, a board or a truck.
            body: body of dm_control to which the instance is attached.
            is_carried: whether an actor carries the surface.

        Raises:
            TownError: the asset does not have exactly one face, or the face has no material or no site `surface`.
        """
        self._fill(file, body)
        model = self._model(file)
        faces = [geom for geom in model.find_all("geom") if class_name(geom.dclass).endswith(".face")]
        if len(faces) != 1:
            raise TownError(
                file.path, f"must have one geom of a class ending in `.face` to show a patch, has {len(faces)}"
            )
        face = faces[0]
        if model.find("site", "surface") is None or face.material is None:
            raise TownError(file.path, f"face {face.name!r} needs a material, and a site `surface` in its middle")
        if isinstance(face.material, str):  # dm_control keeps names that it cannot resolve as text
            raise TownError(file.path, f"face {face.name!r} has the material {face.material!r}, which is not there")
        geom = self._root.find("geom", f"{body.name}_{face.name}")
        geom.material = self._own_material(face.material, geom.name)
        return FaceNames(
            asset=file.path.stem,
            owner=body.name,
            is_carried=is_carried,
            geom=geom.name,
            site=f"{body.name}_surface",
            neutral_material=face.material.full_identifier,
        )

    def drop_templates(self) -> None:
        """Removes the original bodies of the attached files from the tree. Their meshes, textures and materials remain
        for the instances.
        """
        for model in self._models.values():
            for child in list(model.worldbody.all_children()):
                child.remove()

    def put_copies_into(self, tree: ET.Element) -> None:
        """Inserts the copies that `copy_instance` requested into the MJCF tree that dm_control wrote.

        Args:
            tree: root of the tree, changed in place.
        """
        for worldbody in tree.iterfind("worldbody"):
            put_copies_into(worldbody, self._copies)

    def put_defaults_into(self, xml: str) -> str:
        """Inserts the default classes that dm_control did not read into the MJCF text that dm_control wrote.
        Returns the complete text.

        Args:
            xml: the MJCF text of the whole world.
        """
        for name, defaults in self._defaults.items():
            before, empty, after = xml.partition(f'<default class="{name}/"/>')
            assert empty  # dm_control writes an empty class for every file
            xml = before + defaults + after
        return xml

    def _model(self, file: AssetFile) -> mjcf.RootElement:
        """The dm_control model of an asset's file; it is attached at the first call."""
        if file not in self._models:
            for other in self._models:
                if other.name == file.name:
                    problem = f"has the name of {other.path}, which is in the same world; rename one of them"
                    raise TownError(file.path, problem)
            split = self._files[file]
            model = load_mjcf(file.path, split.text, split.mesh_paths, file.name)
            if _angle_settings(model) != self._angles:
                problem = "turns geoms by {} and the town by {}; write both with the same compiler setting"
                raise TownError(file.path, problem.format(_angle_settings(model), self._angles))
            if split.text is not None:
                self._defaults[model.model] = split.defaults
            try:
                self._root.attach(model)
            except ValueError as error:
                raise TownError(file.path, f"cannot be put into one world with the town: {error}") from error
            self._share_textures(model)
            self._models[file] = model
            self._plates[file] = list(_plates_of(model))
        return self._models[file]

    def _share_textures(self, model: mjcf.RootElement) -> None:
        """Replaces textures of a file by equal ones (same image, same attributes) of a file that was attached
        before.
        """
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
                for user in (material, *material.all_children()):
                    if getattr(user, "texture", None) is texture:
                        user.texture = known
            texture.remove()

    def _own_material(self, material: Any, name: str) -> Any:
        """A copy of a material whose colour comes from a texture of its own, with the size of a face."""
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


def _angle_settings(model: mjcf.RootElement) -> str:
    """The compiler settings of a file that define how its angles are written.

    A composed world has one such setting, so files with different settings cannot be composed.
    """
    return f"angle={model.compiler.angle or 'degree'} eulerseq={model.compiler.eulerseq or 'xyz'}"


def _plates_of(model: mjcf.RootElement) -> Iterator[tuple[str, list[Any]]]:
    """Names of the geoms whose class ends in `.plate`, each with its meshes: its own mesh `m`, and `m_1`, `m_2` …"""
    for geom in model.find_all("geom"):
        if class_name(geom.dclass).endswith(".plate") and getattr(geom.mesh, "name", None):
            meshes = [geom.mesh]
            while (other := model.find("mesh", f"{geom.mesh.name}_{len(meshes)}")) is not None:
                meshes.append(other)
            yield geom.name, meshes


def _attributes_outside(element: Any) -> dict[str, Any]:
    """Attributes of an element as they must be written in the tree to which the element's file is attached."""
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
