//! How a run writes what it computes, kept for the run that continues it.

use std::{io, num::NonZeroUsize, path::Path};

use cloth::io::FrameFormat;
use serde::{Deserialize, Serialize};

use super::{FolderError, RunFolder, text_read, text_write};
use crate::{
    arguments::{FormatList, OverlayArguments, PictureSize, RunArguments},
    failure::{Failure, ReadError},
};

/// Name of the file.
pub(super) const FILE: &str = "run.json";

/// What of the arguments of a run concerns its outputs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunSettings {
    /// Output formats, each once.
    pub(crate) formats: Vec<FrameFormat>,
    /// Every so many frames go into them.
    pub(crate) frame_stride: usize,
    pub(crate) picture_size: PictureSize,
    /// What pictures show on cloth.
    pub(crate) overlays: OverlayArguments,
    /// Whether pictures are drawn through the GPU.
    pub(crate) render: bool,
}

/// The settings in the folder of the run.
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    format: Vec<String>,
    frame_stride: NonZeroUsize,
    picture_size: String,
    /// Runs of earlier versions have none.
    #[serde(default, flatten)]
    overlays: OverlayArguments,
    render: bool,
}

impl RunSettings {
    /// What `arguments` ask for. A run that continues another has its formats, too, and otherwise what that one had where nothing else is
    /// asked for.
    pub(crate) fn new(
        arguments: &RunArguments,
        continued: Option<&RunFolder>,
    ) -> Result<Self, Failure> {
        let earlier = continued.map(Self::read).transpose()?.flatten();
        let mut formats = match (&arguments.format, &earlier) {
            (Some(FormatList(formats)), _) => formats.clone(),
            (None, Some(_)) => Vec::new(),
            (None, None) => FormatList::default().0,
        };
        let first = earlier.iter().flat_map(|settings| &settings.formats);
        let added = first.filter(|format| !formats.contains(format)).copied().collect::<Vec<_>>();
        formats.extend(added);
        let earlier = earlier.as_ref();
        Ok(Self {
            formats,
            frame_stride: (arguments.frame_stride.map(NonZeroUsize::get))
                .or(earlier.map(|settings| settings.frame_stride))
                .unwrap_or(1),
            picture_size: (arguments.picture_size)
                .or(earlier.map(|settings| settings.picture_size))
                .unwrap_or_default(),
            overlays: arguments.overlays.or(earlier.map(|settings| &settings.overlays)),
            render: arguments.render || earlier.is_some_and(|settings| settings.render),
        })
    }

    /// What the run in `folder` had, if it says so.
    fn read(folder: &RunFolder) -> Result<Option<Self>, Failure> {
        let path = folder.root.join(FILE);
        let text = match text_read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            text => text.map_err(ReadError::of(&path))?,
        };
        Self::of_text(&text).map(Some).map_err(|problem| {
            let problem = format!("`{FILE}` is damaged: {problem}; remove it");
            Failure::input(FolderError { folder: folder.root.clone(), problem })
        })
    }

    fn of_text(text: &str) -> Result<Self, String> {
        let record: Record = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let names = record.format.join(",");
        let formats: FormatList = if names.is_empty() { "none" } else { &names }.parse()?;
        Ok(Self {
            formats: formats.0,
            frame_stride: record.frame_stride.get(),
            picture_size: record.picture_size.parse()?,
            overlays: record.overlays,
            render: record.render,
        })
    }

    /// Puts the settings down in the folder of the run.
    pub(crate) fn write(&self, root: &Path) -> Result<(), Failure> {
        let PictureSize { width, height } = self.picture_size;
        let record = Record {
            format: self.formats.iter().map(|format| format.name().to_owned()).collect(),
            frame_stride: NonZeroUsize::new(self.frame_stride).unwrap_or(NonZeroUsize::MIN),
            picture_size: format!("{width}x{height}"),
            overlays: self.overlays.clone(),
            render: self.render,
        };
        let text = serde_json::to_string_pretty(&record).map_err(Failure::other)?;
        text_write(&root.join(FILE), &text)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::arguments::Overlay;

    #[test]
    fn settings_come_back() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::new(Some(root.path()), "flag");
        assert_eq!(RunSettings::read(&folder).unwrap(), None);
        for formats in [vec![], vec![FrameFormat::Png, FrameFormat::Npz]] {
            let picture_size = PictureSize { width: 64, height: 36 };
            let overlays = OverlayArguments {
                overlay: vec![Overlay::Threads, Overlay::Strain],
                strain_scale: Some(0.25),
            };
            let settings =
                RunSettings { formats, frame_stride: 3, picture_size, overlays, render: true };
            settings.write(root.path()).unwrap();
            assert_eq!(RunSettings::read(&folder).unwrap(), Some(settings));
        }
        // As an earlier version wrote it.
        let text = r#"{ "format": [], "frame_stride": 1, "picture_size": "8x8", "render": false }"#;
        fs::write(root.path().join(FILE), text).unwrap();
        let earlier = RunSettings::read(&folder).unwrap().unwrap();
        assert_eq!(earlier.overlays, OverlayArguments::default());
        fs::write(root.path().join(FILE), "{").unwrap();
        let message = RunSettings::read(&folder).unwrap_err().sentence();
        assert!(message.contains("`run.json` is damaged"), "{message}");
    }
}
