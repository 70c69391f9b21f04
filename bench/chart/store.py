"""Finished runs on disk: one record (JSON) each, with images beside it. A record appears whole or not at all."""
import json
import os
import tempfile


class Store:
    """FOLDER/runs/KE/KEY.json, and KEY.exr if the run made an image. Safe to use from several programs at once."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)
        os.makedirs(os.path.join(self.folder, "runs"), exist_ok=True)

    def path(self, key, suffix):
        folder = os.path.join(self.folder, "runs", key[:2])
        os.makedirs(folder, exist_ok=True)
        return os.path.join(folder, key + suffix)

    def get(self, key):
        """The record, or None if the run has not finished, or its image is gone."""
        try:
            with open(self.path(key, ".json"), encoding="utf-8") as file:
                record = json.load(file)
        except (FileNotFoundError, ValueError):
            return None
        image = record.get("image")
        if image and not os.path.exists(self.path(key, image)):
            return None
        return self._with_path(key, record)

    def put(self, key, record):
        """`record["image"]`, if there is one, is the suffix of the image at path(key, suffix), already there."""
        self.put_text(self.path(key, ".json"), json.dumps(record, indent=1))
        return self._with_path(key, dict(record))

    def _with_path(self, key, record):
        record["key"] = key
        if record.get("image"):
            record["image"] = self.path(key, record["image"])
        return record

    @staticmethod
    def put_text(path, text):
        handle, new = tempfile.mkstemp(dir=os.path.dirname(os.path.abspath(path)), prefix=".new-")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(new, 0o644)
        os.replace(new, path)
