//! Quotations in messages about files that other files name. A manifest may name any file of the machine, whose text
//! must not reach readers of the messages.

use crate::diagnostic::Diagnostic;
use std::path::Path;

/// Removes quotations from a message about a file outside the folder of `main` and its subfolders. `main` is the
/// manifest, the scene or the deck that names the file.
pub fn without_foreign_quotes(diagnostic: Diagnostic, main: &Path) -> Diagnostic {
    let is_foreign = diagnostic.file().is_some_and(|file| !lies_beside(file, main));
    if is_foreign { diagnostic.without_quotes() } else { diagnostic }
}

/// Returns true if `file` lies in the folder of `main` or below, after following links, or if one of them cannot be
/// found.
fn lies_beside(file: &Path, main: &Path) -> bool {
    let (Ok(file), Ok(main)) = (file.canonicalize(), main.canonicalize()) else { return true };
    main.parent().is_none_or(|folder| file.starts_with(folder))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Code;

    #[test]
    fn files_elsewhere_are_not_quoted() {
        let folder = tempfile::tempdir().expect("a folder");
        let (inside, outside) = (folder.path().join("model"), folder.path().join("secret"));
        std::fs::create_dir_all(inside.join("deep")).expect("folders");
        let [main, near] = [inside.join("model.toml"), inside.join("deep/nodes.csv")];
        for file in [&main, &near, &outside] {
            std::fs::write(file, "x").expect("written");
        }
        let told = |file: &Path| {
            let diagnostic = Diagnostic::new(Code::TableHeader, "column `x`").in_file(file);
            without_foreign_quotes(diagnostic, &main).message().to_owned()
        };
        assert_eq!(told(&near), "column `x`");
        assert_eq!(told(&inside.join("deep/../../secret")), "column `...`");
        #[cfg(unix)]
        {
            let link = inside.join("nodes.csv");
            std::os::unix::fs::symlink(&outside, &link).expect("a link");
            assert_eq!(told(&link), "column `...`");
        }
    }
}
