"""The only module that deletes, renames or opens files for writing in folders of the user.

A folder may come from another person and contain links that lead elsewhere. Two checks protect files outside of it:

- `refuse_links` searches an output folder for links before a command changes anything in it.
- Every change opens the folders from the root to the file one after another, without following links (`O_NOFOLLOW`). A
  link that is made after the search is therefore refused as well.

The root itself, and the folders above it, are the user's choice and may be links. The module needs a POSIX system.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from gear.dataset.disk_errors import explained
from gear.values.errors import DatasetError

FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
REMEDY = "gear writes and deletes nothing through links; put the folder or file itself there, or use another --out"


def parts_of(root: Path, relative: str) -> tuple[str, ...]:
    """The components of a relative path; the path is checked as text, without reading the disk.

    Args:
        root: folder of the dataset; used only in the error message.
        relative: a path with slashes, relative to the root.

    Raises:
        DatasetError: the path is empty or absolute, contains `..`, or holds characters that other systems use as
            separators.
    """
    pure = PurePosixPath(relative)
    if pure.is_absolute() or ".." in pure.parts or not pure.parts or "\\" in relative or "\0" in relative:
        raise DatasetError(root, f"{relative!r} is not a path inside a dataset")
    return pure.parts


def inside(root: Path, relative: str) -> Path:
    """The path `root/relative` for reading; links are followed if they stay below the root.

    Args:
        root: folder that the path must not leave, such as the folder of a dataset.
        relative: path with slashes, relative to the root; the file need not exist.

    Raises:
        DatasetError: the path is absolute, contains `..`, or leads out of the root through a link.
    """
    path = root.joinpath(*parts_of(root, relative))
    try:
        leads_out = not path.resolve().is_relative_to(root.resolve())
    except (OSError, RuntimeError) as error:  # a loop of links
        raise DatasetError(path, "is a link that leads nowhere") from error
    if leads_out:
        raise DatasetError(root, f"{relative!r} leads outside the dataset through a link")
    return path


def owned(root: Path, relative: str) -> Path:
    """The path `root/relative` for writing and deleting; no component below the root may be a link.

    Args:
        root: folder that the path must not leave, such as the folder of a dataset.
        relative: path with slashes, relative to the root; the file need not exist.

    Raises:
        DatasetError: the path is absolute, contains `..`, or a component is a link.
    """
    path = root
    for part in parts_of(root, relative):
        path = path / part
        if path.is_symlink():
            raise _link_error(path)
    return path


def refuse_links(root: Path, *, with_hidden: bool = False) -> None:
    """Checks that a folder contains no links, before a command writes or deletes anything in it.

    Args:
        root: the folder.
        with_hidden: whether hidden files and folders in it (`.git`, `.venv`) are searched; gear writes none into a
            user's folder.

    Raises:
        DatasetError: there is a link, or the root is a file.
    """
    with explained(root):
        if not root.exists():
            return
        pending = [root]
        while pending:
            # A folder that another run has just removed holds no link; one that cannot be read is no place of gear's.
            with contextlib.suppress(FileNotFoundError, PermissionError), os.scandir(pending.pop()) as entries:
                for entry in entries:
                    is_searched = with_hidden or not entry.name.startswith(".")
                    if is_searched and entry.is_symlink():
                        raise _link_error(Path(entry.path))
                    if is_searched and entry.is_dir(follow_symlinks=False):
                        pending.append(Path(entry.path))


@contextlib.contextmanager
def opened_parent(root: Path, relative: str, *, make: bool = False) -> Iterator[tuple[int, str]]:
    """A context that yields the parent folder of `root/relative` as an open descriptor, and the name of the file
    in it.

    Args:
        root: folder that is opened even if it is a link.
        relative: path whose folders are opened one by one, without following links.
        make: whether missing folders below the root are created.

    Raises:
        DatasetError: the path is absolute, contains `..`, or a component is a link.
        OSError: a folder is missing, is a file or cannot be opened.
    """
    *folders, name = parts_of(root, relative)
    with contextlib.ExitStack() as stack:
        descriptor = os.open(root, FOLDER)
        stack.callback(os.close, descriptor)
        path = root
        for part in folders:
            path = path / part
            if make:
                with contextlib.suppress(FileExistsError):
                    os.mkdir(part, dir_fd=descriptor)
            try:
                inner = os.open(part, FOLDER | os.O_NOFOLLOW, dir_fd=descriptor)
            except OSError:
                if _is_link(part, descriptor):
                    raise _link_error(path) from None
                raise
            stack.callback(os.close, inner)
            descriptor = inner
        if _is_link(name, descriptor):
            raise _link_error(path / name)
        yield descriptor, name


def remove_file(root: Path, relative: str) -> None:
    """Deletes a file below the root; a missing file is not an error.

    Args:
        root: folder that no path may leave.
        relative: path of the file, relative to the root.

    Raises:
        DatasetError: a component of the path is a link, or the file cannot be deleted.
    """
    with (
        explained(root / relative),
        contextlib.suppress(FileNotFoundError),
        opened_parent(root, relative) as (folder, name),
    ):
        os.unlink(name, dir_fd=folder)


def remove_files(root: Path, relatives: Iterable[str]) -> None:
    """Deletes files below the root; all paths are checked before the first file is deleted.

    Args:
        root: folder that no path may leave.
        relatives: paths of the files, relative to the root; missing files are not an error.

    Raises:
        DatasetError: a component of a path is a link, or a file cannot be deleted.
    """
    checked = list(relatives)
    for relative in checked:
        owned(root, relative)
    for relative in checked:
        remove_file(root, relative)


def remove_tree(root: Path, relative: str) -> None:
    """Deletes a folder below the root with its content; links in the folder are deleted and not followed.

    Args:
        root: folder that no path may leave.
        relative: path of the folder, relative to the root; a missing folder is not an error.

    Raises:
        DatasetError: a component of the path is a link, or a file cannot be deleted.
    """
    with (
        explained(root / relative),
        contextlib.suppress(FileNotFoundError),
        opened_parent(root, relative) as (folder, name),
    ):
        shutil.rmtree(name, dir_fd=folder)


def empty_tree(root: Path, relative: str) -> None:
    """Deletes everything in a folder below the root; links in the folder are deleted and not followed.

    Args:
        root: folder that is opened even if it is a link.
        relative: path of the folder, relative to the root.

    Raises:
        DatasetError: a component of the path is a link, or a file cannot be deleted.
    """
    with explained(root / relative), opened_parent(root, f"{relative}/x") as (folder, _):
        for name in os.listdir(folder):  # noqa: PTH208 (a folder descriptor)
            if stat.S_ISDIR(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
                shutil.rmtree(name, dir_fd=folder)
            else:
                os.unlink(name, dir_fd=folder)


def remove_empty_folders(root: Path, relative: str) -> None:
    """Deletes the folder `root/relative` and all folders in it, as far as they are empty; innermost folders first.

    Args:
        root: folder that no path may leave.
        relative: path of the folder, relative to the root.

    Raises:
        DatasetError: a component of the path is a link.
    """
    top = owned(root, relative)
    for path, _, _ in os.walk(top, topdown=False, followlinks=False):
        inner = Path(path).relative_to(root).as_posix()
        with contextlib.suppress(OSError), opened_parent(root, inner) as (folder, name):
            os.rmdir(name, dir_fd=folder)


def refuse_shared(descriptor: int, path: Path) -> None:
    """Refuses to write into an open file that may also be a file outside of the root: one with several hard links.

    A file that another run has removed meanwhile has none, and passes.

    Args:
        descriptor: descriptor of the open file.
        path: path of the file, for the message.

    Raises:
        DatasetError: the file has several hard links, or is no regular file.
    """
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        raise DatasetError(path, "is no regular file; delete it, or use another --out")
    if status.st_nlink > 1:
        raise DatasetError(path, "is a hard link to a file with other names; delete it, or use another --out")


def _is_link(name: str, folder: int) -> bool:
    try:
        return stat.S_ISLNK(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode)
    except OSError:
        return False


def _link_error(path: Path) -> DatasetError:
    return DatasetError(path, f"is a link; {REMEDY}")
