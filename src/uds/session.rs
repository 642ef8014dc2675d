//! The session that each service needs, and the services with sub-functions (ISO 14229-1).

use automotive_diag::uds::UdsCommand;

/// A diagnostic session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Session {
    /// Data and troubles can be read.
    Default = 1,
    /// Weights can also be downloaded, and everything of [`Self::Extended`] is allowed.
    Programming = 2,
    /// Settings can also be written, and routines run.
    Extended = 3,
}

/// Returns the session that a service needs, and whether it has a sub-function, the first byte of its request and of its
/// response.
pub(super) fn rules(command: UdsCommand) -> (Session, bool) {
    match command {
        UdsCommand::DiagnosticSessionControl
        | UdsCommand::ECUReset
        | UdsCommand::TesterPresent
        | UdsCommand::ReadDTCInformation => (Session::Default, true),
        UdsCommand::CommunicationControl
        | UdsCommand::ControlDTCSetting
        | UdsCommand::SecurityAccess
        | UdsCommand::RoutineControl => (Session::Extended, true),
        UdsCommand::WriteDataByIdentifier => (Session::Extended, false),
        UdsCommand::RequestDownload | UdsCommand::TransferData | UdsCommand::RequestTransferExit => {
            (Session::Programming, false)
        }
        _ => (Session::Default, false),
    }
}
