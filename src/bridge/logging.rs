//! The library's messages: to a caller's function, else to the system's log where there is one.
//!
//! Any control thread. Messages come from control threads and from the threads of the engine that open devices, never from
//! the audio thread.

use std::sync::{OnceLock, RwLock};

use log::{LevelFilter, Log, Metadata, Record};

use super::enumeration::LogLevel;
use super::error::{CallError, Status};

/// A receiver of messages.
pub type Receiver = Box<dyn Fn(LogLevel, &str) + Send + Sync>;

/// The process's logger, once [`install`] has made it so.
struct Logger {
    receiver: RwLock<Option<(LevelFilter, Receiver)>>,
    system: OnceLock<Box<dyn Log>>,
    installed: OnceLock<bool>,
}

static LOGGER: Logger = Logger {
    receiver: RwLock::new(None),
    system: OnceLock::new(),
    installed: OnceLock::new(),
};

/// Messages of the system's log.
const SYSTEM_LEVEL: LevelFilter = LevelFilter::Info;

fn level(of: log::Level) -> LogLevel {
    match of {
        log::Level::Error => LogLevel::Error,
        log::Level::Warn => LogLevel::Warn,
        log::Level::Info => LogLevel::Info,
        log::Level::Debug | log::Level::Trace => LogLevel::Debug,
    }
}

impl Log for Logger {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &Record<'_>) {
        // A message while the receiver is exchanged is dropped: its thread may be the one that waits.
        let Ok(receiver) = self.receiver.try_read() else {
            return;
        };
        match (&*receiver, self.system.get()) {
            (Some((most, receive)), _) if record.level() <= *most => {
                receive(level(record.level()), &record.args().to_string());
            }
            (None, Some(system)) if record.level() <= SYSTEM_LEVEL => system.log(record),
            _ => {}
        }
    }

    fn flush(&self) {}
}

/// Makes this the process's logger. `system` is the system's log. Returns whether the process has no other logger.
pub fn install(system: Option<Box<dyn Log>>) -> bool {
    if let Some(system) = system {
        // Loaded once: a second one is the same.
        let _ = LOGGER.system.set(system);
        log::set_max_level(SYSTEM_LEVEL);
    }
    *LOGGER
        .installed
        .get_or_init(|| log::set_logger(&LOGGER).is_ok())
}

/// Sets the receiver of messages up to a level; `None` for none. Waits for messages under way: not from a receiver.
///
/// # Errors
/// `Status::BadArgument` for a level out of range; `Status::State` if the process has another logger.
pub fn set_receiver(most: LogLevel, receiver: Option<Receiver>) -> Result<(), CallError> {
    const FILTERS: [LevelFilter; 5] = [
        LevelFilter::Off,
        LevelFilter::Error,
        LevelFilter::Warn,
        LevelFilter::Info,
        LevelFilter::Debug,
    ];
    let Some(filter) = FILTERS.get(most.0 as usize).copied() else {
        return Err(CallError::bad(format!(
            "level: {} is outside 0 to 4",
            most.0
        )));
    };
    if !install(None) {
        const OTHER: &str = "the process has another logger of the crate log; use that one";
        return Err(CallError::fixed(Status::State, OTHER));
    }
    let mut slot = match LOGGER.receiver.write() {
        Ok(slot) => slot,
        // A receiver that panicked left nothing half done.
        Err(poisoned) => poisoned.into_inner(),
    };
    *slot = receiver.map(|receiver| (filter, receiver));
    log::set_max_level(match &*slot {
        Some(_) => filter,
        None if LOGGER.system.get().is_some() => SYSTEM_LEVEL,
        None => LevelFilter::Off,
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn messages_reach_the_receiver_up_to_its_level() {
        let (sender, messages) = mpsc::channel();
        let receiver: Receiver = Box::new(move |level, text| {
            let _ = sender.send((level, text.to_owned()));
        });
        assert!(set_receiver(LogLevel(5), None).is_err());
        set_receiver(LogLevel::Warn, Some(receiver)).expect("no other logger");
        log::info!("too light");
        log::warn!("heard {}", 1);
        set_receiver(LogLevel::Off, None).expect("no other logger");
        log::error!("too late");
        let ours = messages
            .iter()
            .filter(|(_, text)| text.starts_with("heard"));
        assert_eq!(
            ours.collect::<Vec<_>>(),
            [(LogLevel::Warn, "heard 1".to_owned())]
        );
    }
}
