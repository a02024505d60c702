//! A program from which a file is dragged onto the window (the protocol XDND, version 5).

use std::{error::Error, path::Path, time::Duration, time::Instant};

use x11rb::{
    CURRENT_TIME,
    connection::Connection,
    protocol::{
        Event,
        xproto::{
            Atom, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode,
            SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, WindowClass,
        },
    },
    rust_connection::RustConnection,
    wrapper::ConnectionExt as _,
};

/// Drops `path` into the middle of the window with the number `target`.
pub(crate) fn drop_file(display: &str, target: u32, path: &Path) -> Result<(), Box<dyn Error>> {
    let (connection, screen) = x11rb::connect(Some(display))?;
    let root = connection.setup().roots[screen].root;
    let source = connection.generate_id()?;
    let nothing = CreateWindowAux::new();
    let class = WindowClass::INPUT_OUTPUT;
    connection.create_window(0, source, root, 0, 0, 1, 1, 0, class, 0, &nothing)?;
    let atom = |name: &str| -> Result<Atom, Box<dyn Error>> {
        Ok(connection.intern_atom(false, name.as_bytes())?.reply()?.atom)
    };
    let selection = atom("XdndSelection")?;
    let uri_list = atom("text/uri-list")?;
    connection.set_selection_owner(source, selection, CURRENT_TIME)?;
    let tell = |name: &str, data: [u32; 4]| -> Result<(), Box<dyn Error>> {
        let data = [source, data[0], data[1], data[2], data[3]];
        let message = ClientMessageEvent::new(32, target, atom(name)?, data);
        connection.send_event(false, target, EventMask::NO_EVENT, message)?;
        Ok(connection.flush()?)
    };
    tell("XdndEnter", [5 << 24, uri_list, 0, 0])?;
    tell("XdndPosition", [0, 300 << 16 | 300, CURRENT_TIME, atom("XdndActionCopy")?])?;
    let text = format!("file://{}\r\n", path.display());
    let start = Instant::now();
    let mut dropped = false;
    let finished = atom("XdndFinished")?;
    while start.elapsed() < Duration::from_secs(60) {
        match connection.poll_for_event()? {
            Some(Event::SelectionRequest(request)) => {
                hand_over(&connection, &request, &text)?;
                // It has what it needs to decide.
                if !dropped {
                    tell("XdndDrop", [0, CURRENT_TIME, 0, 0])?;
                    dropped = true;
                }
            }
            Some(Event::ClientMessage(message)) if message.type_ == finished => return Ok(()),
            Some(_) => {}
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    }
    Err("the window takes nothing".into())
}

/// Gives the window the list of files.
fn hand_over(
    connection: &RustConnection,
    request: &SelectionRequestEvent,
    text: &str,
) -> Result<(), Box<dyn Error>> {
    connection.change_property8(
        PropMode::REPLACE,
        request.requestor,
        request.property,
        // Of the kind that was asked for.
        request.target,
        text.as_bytes(),
    )?;
    let answer = SelectionNotifyEvent {
        response_type: SELECTION_NOTIFY_EVENT,
        sequence: 0,
        time: request.time,
        requestor: request.requestor,
        selection: request.selection,
        target: request.target,
        property: request.property,
    };
    connection.send_event(false, request.requestor, EventMask::NO_EVENT, answer)?;
    Ok(connection.flush()?)
}
