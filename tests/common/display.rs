//! A display of a test's own, without a screen. Xvfb keeps what it shows in a file, so a look at it takes no further
//! tool; xdotool presses keys.

use super::prelude::*;
use image::{Rgb, RgbImage};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Software rendering on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Ends a process with the test, however the test ends.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until there is an answer.
///
/// # Panics
/// If none comes in [`PATIENCE`].
pub fn wait_for<T>(what: &str, mut answer: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(answer) = answer() {
            return answer;
        }
        assert!(Instant::now() < end, "waited {PATIENCE:?} for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A display without a screen. No window manager: windows are at the top left.
pub struct Display {
    /// For `DISPLAY`.
    pub name: String,
    screen: PathBuf,
    _server: Running,
}

impl Display {
    /// In a folder for its files. `None`, said aloud, where something is missing to test with.
    ///
    /// # Panics
    /// In strict mode, where something is missing.
    pub fn start(folder: &Path) -> Option<Self> {
        let missing = missing();
        if !missing.is_empty() {
            super::skip(&format!("missing: {}", missing.join(", ")));
            return None;
        }
        let folder = folder.join("display");
        fs::create_dir(&folder).expect("a folder");
        let mut server = Command::new("Xvfb");
        // Larger than the window, so that the pointer, in the middle, is outside of it. Without `-noreset`, the server
        // would start anew whenever its last client goes: xdotool, while the program is about to connect.
        let screen = ["-noreset", "-nolisten", "tcp", "-screen", "0", "1024x600x24"];
        server.args(screen).args(["-displayfd", "1", "-fbdir"]).arg(&folder);
        let server = server.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("Xvfb starts");
        let mut server = Running(server);
        let mut number = String::new();
        let output = server.0.stdout.take().expect("piped");
        BufReader::new(output).read_line(&mut number).expect("the number of the display");
        let name = format!(":{}", number.trim());
        Some(Self { name, screen: folder.join("Xvfb_screen0"), _server: server })
    }

    /// Runs xdotool and returns its output; `None` if it fails.
    pub fn xdotool(&self, arguments: &[&str]) -> Option<String> {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output();
        let output = output.expect("xdotool starts");
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// So much of the screen, from its top left. The file is an X window dump: a header of big-endian words, colours,
    /// pixels.
    pub fn look(&self, (width, height): (u32, u32)) -> Option<RgbImage> {
        let dump = fs::read(&self.screen).ok()?;
        let word = |index: usize| {
            let bytes = dump.get(index * 4..index * 4 + 4)?;
            Some(u32::from_be_bytes(bytes.try_into().ok()?) as usize)
        };
        let (header, line, colors) = (word(0)?, word(12)?, word(19)?);
        let little_endian = word(7)? == 0;
        let pixels = dump.get(header + colors * 12..)?;
        let mut picture = RgbImage::new(width, height);
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let at = y as usize * line + x as usize * 4;
            let bytes: [u8; 4] = pixels.get(at..at + 4)?.try_into().ok()?;
            let value = if little_endian { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) };
            let [blue, green, red, _] = value.to_le_bytes();
            *pixel = Rgb([red, green, blue]);
        }
        Some(picture)
    }
}

/// Missing requirements of window tests.
pub fn missing() -> Vec<&'static str> {
    let lacks = |program: &&str| Command::new(program).arg("-help").output().is_err();
    let mut missing: Vec<&str> = ["Xvfb", "xdotool"].into_iter().filter(lacks).collect();
    let adapter = relief::renderer::Gpu::headless().is_ok();
    missing.extend((!adapter).then_some("a graphics adapter"));
    missing
}
