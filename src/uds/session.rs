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

pub(super) fn needed(command: UdsCommand) -> Session {
    match command {
        UdsCommand::CommunicationControl
        | UdsCommand::ControlDTCSetting
        | UdsCommand::WriteDataByIdentifier
        | UdsCommand::SecurityAccess
        | UdsCommand::RoutineControl => Session::Extended,
        UdsCommand::RequestDownload | UdsCommand::TransferData | UdsCommand::RequestTransferExit => {
            Session::Programming
        }
        _ => Session::Default,
    }
}

/// Returns whether a service has a sub-function, the first byte of its request and of its response.
pub(super) fn has_sub_function(command: UdsCommand) -> bool {
    matches!(
        command,
        UdsCommand::DiagnosticSessionControl
            | UdsCommand::ECUReset
            | UdsCommand::TesterPresent
            | UdsCommand::CommunicationControl
            | UdsCommand::ControlDTCSetting
            | UdsCommand::ReadDTCInformation
            | UdsCommand::SecurityAccess
            | UdsCommand::RoutineControl
    )
}
