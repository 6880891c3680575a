"""What the documentation site holds: a hook of MkDocs, named in mkdocs.yml.

Every file keeps its path in the repository, so that a page's relative links work in both places.
"""

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
SHOWN = (
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "CITATION.cff"),
    *("docs/**/*.*", "benchmarks/*.md", "assets/**/*.md", "assets/**/*.png"),
    *("controllers/**/*.py", "mjspace/scenarios/*.toml"),
)


def on_files(files: Files, config: Any) -> Files:
    """Return the repository's pages, their pictures and what they link to, with the theme's own."""
    pages = ROOT / "docs"
    kept = [file for file in files if not Path(file.abs_src_path or "").is_relative_to(pages)]
    shown = {path for pattern in SHOWN for path in ROOT.glob(pattern) if path.is_file()}
    return Files(
        [
            *kept,
            *(
                File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path))
                for path in sorted(shown)
            ),
        ]
    )
