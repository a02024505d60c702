//! What a screen shows.

use image::RgbImage;
use x11rb::{
    connection::Connection,
    protocol::xproto::{ConnectionExt, ImageFormat, ImageOrder},
};

/// The pixels of a window on a screen of 24 bits.
pub(crate) fn window_picture(display: &str, window: u32) -> RgbImage {
    let (connection, _) = x11rb::connect(Some(display)).unwrap();
    let size = connection.get_geometry(window).unwrap().reply().unwrap();
    let (width, height) = (size.width, size.height);
    let image = connection.get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, !0);
    let image = image.unwrap().reply().unwrap();
    assert_eq!((image.depth, connection.setup().image_byte_order), (24, ImageOrder::LSB_FIRST));
    let row = usize::from(width) * 4;
    RgbImage::from_fn(width.into(), height.into(), |x, y| {
        let start = y as usize * row + x as usize * 4;
        // Blue comes first.
        image::Rgb([image.data[start + 2], image.data[start + 1], image.data[start]])
    })
}
