use std::fs;
use std::io::ErrorKind;

use super::*;

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn a_complete_file_replaces_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.txt");
    write(&path, |file| file.write_all(b"old")).unwrap();
    write(&path, |file| file.write_all(b"new")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(names(folder.path()), ["out.txt"]);
}

#[test]
fn a_failure_half_way_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.txt");
    let half = |file: &mut BufWriter<&File>| {
        file.write_all(&[0; 100_000])?;
        Err(io::Error::from(ErrorKind::StorageFull))
    };
    assert!(matches!(
        write(&path, half),
        Err(OutputError::DiskFull { .. })
    ));
    assert!(names(folder.path()).is_empty());
    fs::write(&path, b"old").unwrap();
    assert!(write(&path, half).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["out.txt"]);
}

/// /dev/full accepts a file's opening and refuses its bytes, but no file can be made in its folder as a test;
/// what can be tested everywhere is that an error of the last flush is not lost.
#[cfg(target_os = "linux")]
#[test]
fn an_error_that_shows_only_when_flushed_is_reported() {
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.txt");
    let result = write(&path, |_| {
        let mut writer = BufWriter::new(&full);
        writer.write_all(b"fits the buffer")?;
        writer.flush()
    });
    assert!(
        matches!(result, Err(OutputError::DiskFull { .. })),
        "{result:?}"
    );
}

#[test]
fn a_missing_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no/such/out.png");
    match write(&path, |_| Ok(())) {
        Err(OutputError::FolderMissing { folder: named, .. }) => {
            assert_eq!(named, folder.path().join("no/such"));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn folders_and_devices_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    for path in [
        folder.path(),
        Path::new("/dev/null"),
        Path::new("/"),
        Path::new(""),
    ] {
        let result = write(path, |_| Ok(()));
        assert!(
            matches!(result, Err(OutputError::NotAFile { .. })),
            "{path:?}: {result:?}"
        );
    }
}

#[test]
fn names_that_end_like_a_folder_s_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    for there in [false, true] {
        if there {
            fs::write(&path, "old").unwrap();
        }
        for end in ["/", "/.", "/..", "//"] {
            let name = format!("{}{end}", path.display());
            let refused = check(Path::new(&name));
            assert!(refused.is_err(), "{name}");
            // What follows a file's name is no folder, and what is no file is not written to.
            assert!(
                matches!(
                    refused,
                    Err(OutputError::NotAFile { .. } | OutputError::FolderMissing { .. })
                ),
                "{name}: {refused:?}"
            );
        }
    }
    let through = check(&path.join("inner.exr"));
    assert!(matches!(through, Err(OutputError::FolderMissing { .. })));
    assert_eq!(names(folder.path()), ["out.exr"]);
}

#[test]
fn a_name_of_any_length_that_the_system_takes_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let longest = "x".repeat(255);
    let path = folder.path().join(&longest);
    write(&path, |out| out.write_all(b"new")).unwrap();
    assert_eq!(names(folder.path()), std::slice::from_ref(&longest));
    let longer = folder.path().join(longest + "x");
    assert!(matches!(check(&longer), Err(OutputError::Failed { .. })));
}

#[cfg(unix)]
#[test]
fn links_stay_links_and_lead_to_the_file() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("inner")).unwrap();
    fs::write(path("file"), b"old").unwrap();
    symlink(path("file"), path("link")).unwrap();
    symlink("file", path("inner/dangling")).unwrap();
    symlink("inner/dangling", path("to_dangling")).unwrap();
    for (link, file) in [("link", "file"), ("to_dangling", "inner/file")] {
        check(&path(link)).unwrap();
        write(&path(link), |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(path(link)).unwrap().is_symlink());
        assert_eq!(fs::read(path(file)).unwrap(), b"new");
    }
    symlink("round", path("round")).unwrap();
    symlink("no/such/file", path("astray")).unwrap();
    symlink("inner/", path("to_folder")).unwrap();
    symlink("/dev/null", path("to_device")).unwrap();
    for bad in ["round", "astray", "to_folder", "to_device"] {
        assert!(check(&path(bad)).is_err(), "{bad}");
        assert!(write(&path(bad), |_| Ok(())).is_err(), "{bad}");
    }
    assert!(
        fs::symlink_metadata(path("to_device"))
            .unwrap()
            .is_symlink()
    );
}

#[cfg(unix)]
#[test]
fn a_file_keeps_its_mode_and_a_new_one_has_the_usual() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mode = |name: &str| fs::metadata(path(name)).unwrap().mode() & 0o7777;
    fs::write(path("usual"), b"").unwrap();
    write(&path("new"), |_| Ok(())).unwrap();
    assert_eq!(mode("new"), mode("usual"));
    for bits in [0o600, 0o640, 0o666, 0o755, 0o777] {
        fs::set_permissions(path("new"), fs::Permissions::from_mode(bits)).unwrap();
        write(&path("new"), |file| {
            let now = file.get_ref().metadata()?.mode() & 0o777;
            assert_eq!(now & !bits, 0, "{now:o} while written, {bits:o} in the end");
            Ok(())
        })
        .unwrap();
        assert_eq!(mode("new"), bits);
    }
    // A rename would replace it without asking.
    fs::set_permissions(path("new"), fs::Permissions::from_mode(0o444)).unwrap();
    for refused in [check(&path("new")), write(&path("new"), |_| Ok(()))] {
        assert!(matches!(refused, Err(OutputError::Protected { .. })));
    }
}

#[test]
fn leftovers_of_killed_runs_go_and_those_of_living_ones_stay() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("out"), folder.path().join("other"));
    let leave = |path: &Path| {
        let target = Target::of(path).unwrap();
        let (file, name) = target.temporary().unwrap().keep().unwrap();
        drop(file); // and its lock
        name
    };
    let (left, others) = (leave(&path), leave(&other));
    let living = stage(&path, |out| out.write_all(b"living")).unwrap();
    assert!(!left.exists() && others.exists());
    let mine = Path::new(living.content()).to_owned();
    let stranger = folder.path().join(".prismarch-mine.part");
    fs::write(&stranger, "").unwrap();
    check(&path).unwrap();
    write(&path, |out| out.write_all(b"first")).unwrap();
    assert!(mine.exists() && stranger.exists());
    living.commit().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"living");
    check(&other).unwrap();
    let mut left = names(folder.path());
    left.sort();
    assert_eq!(left, [".prismarch-mine.part", "out"]);
}

/// Two that write one file at once: each write succeeds, and the file is always one of theirs, whole.
#[test]
fn writers_of_one_file_do_not_disturb_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = &folder.path().join("out");
    std::thread::scope(|scope| {
        for letter in [b'a', b'b'] {
            scope.spawn(move || {
                for _ in 0..50 {
                    write(path, |out| out.write_all(&[letter; 10_000])).unwrap();
                    let found = fs::read(path).unwrap();
                    assert!(found.len() == 10_000 && found.iter().all(|&x| x == found[0]));
                }
            });
        }
    });
    assert_eq!(names(folder.path()), ["out"]);
}
