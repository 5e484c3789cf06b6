//! The program with a window on a display of a test's own.

use super::display::{Display, PATIENCE, Running, wait_for};
use super::prelude::*;
use image::RgbImage;
use std::cell::RefCell;
use std::io::{BufRead, BufReader};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const RELIEF: &str = env!("CARGO_BIN_EXE_relief");
/// Size of windows, pixels.
pub const SIZE: (u32, u32) = (480, 270);
/// The pointer goes where it hides nothing of the window.
pub const AWAY: [&str; 3] = ["mousemove", "700", "500"];

/// A folder with a scene, and whatever the program writes.
pub struct Place(TempDir);

impl Place {
    pub fn of(scene: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("test.ron"), scene).expect("a scene file");
        Self(folder)
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Content of a file so far; empty if there is none.
    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path().join(name)).unwrap_or_default()
    }

    pub fn relief(&self) -> Command {
        let mut command = Command::new(RELIEF);
        command.current_dir(self.path()).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.env_remove("DISPLAY").env("WINIT_X11_SCALE_FACTOR", "1").env("RUST_LOG", "error");
        command
    }

    /// Replays `run.rec` without pictures, all of whose steps come out as recorded.
    pub fn check_replay(&self) {
        let replay = self.relief().args(["replay", "run.rec", "--check"]).output().expect("relief starts");
        assert!(replay.status.success(), "{}", super::text(&replay.stderr));
    }

    /// Runs the program with its warnings in `errors.txt`, and a device that is lost after so many checks.
    pub fn losing_after(&self, checks: u32) -> Command {
        let mut command = self.relief();
        command.env("RELIEF_LOSE_DEVICE", checks.to_string()).env("RUST_LOG", "relief=warn");
        command.stderr(fs::File::create(self.path().join("errors.txt")).expect("a file"));
        command
    }

    /// Waits until the device of a run that writes its hashes to `window.txt` is lost, and some steps were done since.
    pub fn wait_for_loss(&self, app: &App<'_>, steps: usize) {
        let lines = || self.read("window.txt").lines().count();
        app.wait_for("the loss", || self.read("errors.txt").contains("the graphics device was lost").then_some(()));
        let lost = lines();
        app.wait_for("steps after it", || (lines() > lost + steps).then_some(()));
    }

    /// The picture of a frame, as `relief render` writes it.
    pub fn rendered(&self, frame: u64, options: &[&str]) -> RgbImage {
        let folder = tempfile::tempdir_in(self.path()).expect("a temporary folder");
        let frames = format!("{frame}..{}", frame + 1);
        let mut command = self.relief();
        command.args(["render", "test.ron", "--size", &size(), "--frames", &frames, "-o"]).arg(folder.path());
        let output = command.args(options).output().expect("relief starts");
        assert!(output.status.success(), "{}", super::text(&output.stderr));
        let picture = folder.path().join(format!("color_{frame:05}.png"));
        image::open(picture).expect("a picture").into_rgb8()
    }
}

pub fn size() -> String {
    format!("{}x{}", SIZE.0, SIZE.1)
}

/// The step that a stopped clock stays at, by what is written: a line for each, and one for the beginning.
pub fn last_step(written: impl Fn() -> String) -> u64 {
    wait_for("the clock to stop", || {
        let before = written().lines().count();
        std::thread::sleep(Duration::from_millis(500));
        (written().lines().count() == before).then_some(before as u64 - 1)
    })
}

/// The program with its window open.
pub struct App<'a> {
    display: &'a Display,
    process: RefCell<Running>,
    lines: Receiver<String>,
}

impl<'a> App<'a> {
    pub fn start(place: &Place, display: &'a Display, options: &[&str]) -> Self {
        Self::of(place.relief(), display, options)
    }

    /// With a scene that stands still and its picture, without the panel.
    pub fn paused(place: &Place, display: &'a Display) -> (Self, RgbImage) {
        let app = Self::start(place, display, &["--paused", "--no-panel"]);
        let plain = place.rendered(0, &[]);
        app.shows("the picture of frame 0", &plain);
        (app, plain)
    }

    pub fn of(mut command: Command, display: &'a Display, options: &[&str]) -> Self {
        command.args(["run", "test.ron", "--size", &size()]).args(options).env("DISPLAY", &display.name);
        let mut process = Running(command.stdout(Stdio::piped()).spawn().expect("relief starts"));
        let (sender, lines) = channel();
        let output = BufReader::new(process.0.stdout.take().expect("piped"));
        std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        let window =
            wait_for("the window", || display.xdotool(&["search", "--onlyvisible", "--name", "^Relief .* test$"]));
        wait_for("the focus", || display.xdotool(&["windowfocus", "--sync", &window]));
        Self { display, process: RefCell::new(process), lines }
    }

    pub fn press(&self, keys: &[&str]) {
        let mut arguments = vec!["key"];
        arguments.extend(keys);
        self.display.xdotool(&arguments).expect("xdotool presses keys");
    }

    pub fn shows(&self, what: &str, wanted: &RgbImage) {
        self.wait_for_picture(what, |seen| seen == wanted);
    }

    /// Waits for a picture, and leaves the last one in the system's folder for temporary files where it does not come.
    pub fn wait_for_picture(&self, what: &str, wanted: impl Fn(&RgbImage) -> bool) -> RgbImage {
        let end = Instant::now() + PATIENCE;
        loop {
            let seen = self.display.look(SIZE).expect("a look at the screen");
            if wanted(&seen) {
                return seen;
            }
            if Instant::now() > end {
                let path = std::env::temp_dir().join("relief-window-test.png");
                let _ = seen.save(&path);
                panic!("waited {PATIENCE:?} for the window to show {what}; the last picture is {}", path.display());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    pub fn line(&self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("a line of output")
    }

    /// Waits until there is an answer, while the program runs.
    pub fn wait_for<T>(&self, what: &str, mut answer: impl FnMut() -> Option<T>) -> T {
        wait_for(what, || {
            let ended = self.ended();
            let answer = answer();
            assert!(answer.is_some() || ended.is_none(), "the program ended ({ended:?}) before {what}");
            answer
        })
    }

    /// Presses the key that ends it, and waits until it has ended well.
    pub fn close(self) {
        self.press(&["Escape"]);
        assert_eq!(self.ends().code(), Some(0));
    }

    pub fn ends(self) -> ExitStatus {
        wait_for("the end of the program", || self.ended())
    }

    fn ended(&self) -> Option<ExitStatus> {
        self.process.borrow_mut().0.try_wait().expect("a process")
    }
}
