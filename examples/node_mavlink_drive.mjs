// See, set up, arm, drive and stop a Junior from JavaScript, with node-mavlink: nothing of this project is needed.
//
// It moves: put it on its ring or on blocks. The robot may be one of yours behind a serial-to-TCP bridge, or an emulated one
// that another shell serves:
//
//     hil emulate junior --link tcp://127.0.0.1:5760
//     npm install node-mavlink
//     node node_mavlink_drive.mjs 127.0.0.1 5760
//
// On a serial port take a `SerialPort` (npm install serialport) in place of the socket; all else stays.
//
// It opens no session, as a ground station does not: so it arms without a number (`param3` 0), and any frame of its own keeps
// the robot moving, at least every 250 ms, best every 100 ms.

import { connect } from 'node:net'
import mavlink from 'node-mavlink'

const { MavLinkData, MavLinkPacketField, MavLinkPacketParser, MavLinkPacketSplitter, MavLinkProtocolV2, MSG_ID_MAGIC_NUMBER } = mavlink
const { common, minimal, send } = mavlink

const STATES = ['disarmed', 'ready', 'driving', 'performing', 'countdown', 'contest', 'stopped']
const ROBOT = 1 // component id of the robot itself
const US = { system: 255, component: 190 }
const PATIENCE = 5000 // longest wait for anything, in ms

// One of Junior's own messages; docs/protocol.md has them all, with their seed (CRC_EXTRA).
class JuniorSensors extends MavLinkData {
  static MSG_ID = 47100
  static MSG_NAME = 'JUNIOR_SENSORS'
  static PAYLOAD_LENGTH = 28
  static MAGIC_NUMBER = 99
  static FIELDS = [
    new MavLinkPacketField('time_usec', 'time', 0, false, 8, 'uint64_t', 'us'),
    new MavLinkPacketField('travel', 'travel', 8, false, 4, 'int32_t[]', 'mm', 2),
    new MavLinkPacketField('eye', 'eye', 16, false, 2, 'uint16_t[]', '', 2),
    new MavLinkPacketField('floor', 'floor', 20, false, 2, 'uint16_t[]', '', 2),
    new MavLinkPacketField('battery', 'battery', 24, false, 2, 'uint16_t', 'mV'),
    new MavLinkPacketField('flags', 'flags', 26, false, 2, 'uint16_t', ''),
  ]
}

const REGISTRY = { ...minimal.REGISTRY, ...common.REGISTRY, [JuniorSensors.MSG_ID]: JuniorSensors }
const magicNumbers = { ...MSG_ID_MAGIC_NUMBER, [JuniorSensors.MSG_ID]: JuniorSensors.MAGIC_NUMBER }

const [host, port] = process.argv.slice(2)
const line = connect({ host, port: Number(port) })
const protocol = new MavLinkProtocolV2(US.system, US.component)
const waiting = new Set()
let system = 0
let wheels = [0, 0]

const reader = line.pipe(new MavLinkPacketSplitter({}, { magicNumbers })).pipe(new MavLinkPacketParser())
reader.on('data', ({ header, payload, protocol: spoken }) => {
  const kind = REGISTRY[header.msgid]
  if (!kind || header.compid !== ROBOT) return
  const message = spoken.data(payload, kind)
  if (kind === JuniorSensors) wheels = message.travel
  for (const wait of waiting) wait(kind, message, header)
})

// The next message of a kind that fits.
function next(kind, fits = () => true) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => finish(() => reject(new Error(`no ${kind.MSG_NAME} came`))), PATIENCE)
    const wait = (got, message, header) => {
      if (got === kind && fits(message)) finish(() => resolve({ message, header }))
    }
    const finish = (how) => {
      clearTimeout(timer)
      waiting.delete(wait)
      how()
    }
    waiting.add(wait)
  })
}

const state = async (wanted) => {
  await next(minimal.Heartbeat, (heartbeat) => STATES[heartbeat.customMode] === wanted)
}

// Whether an answer is for us: what a robot has told another says nothing about a command of ours.
const forUs = (answer) => [0, US.system].includes(answer.targetSystem) && [0, US.component].includes(answer.targetComponent)

async function command(message) {
  message.targetSystem = system
  message.targetComponent = ROBOT
  const answer = next(common.CommandAck, (ack) => forUs(ack) && ack.command === message.command)
  await send(line, message, protocol)
  return (await answer).message.result
}

async function arm(on) {
  const message = new common.ComponentArmDisarmCommand()
  message.arm = on
  return (await command(message)) === common.MavResult.ACCEPTED
}

async function setParameter(name, value) {
  const message = new common.ParamSet()
  Object.assign(message, { targetSystem: system, targetComponent: ROBOT, paramId: name, paramValue: value })
  message.paramType = common.MavParamType.REAL32
  const answer = next(common.ParamValue, (got) => got.paramId === name)
  await send(line, message, protocol)
  return (await answer).message.paramValue
}

async function parameters() {
  const found = new Map()
  const message = new common.ParamRequestList()
  Object.assign(message, { targetSystem: system, targetComponent: ROBOT })
  const all = next(common.ParamValue, (got) => found.set(got.paramId, got.paramValue).size === got.paramCount)
  await send(line, message, protocol)
  await all
  return found
}

// Drive as a joystick does, 20 times a second: the robot stops when it has not heard us, who armed it, for 250 ms.
async function drive(forward, turn, duration) {
  for (let sent = 0; sent < duration / 50; sent++) {
    const message = new common.ManualControl()
    Object.assign(message, { target: system, x: forward, r: turn })
    await send(line, message, protocol)
    await new Promise((resolve) => setTimeout(resolve, 50))
  }
}

async function main() {
  const { header, message } = await next(minimal.Heartbeat, (heartbeat) => heartbeat.type === minimal.MavType.GROUND_ROVER)
  system = header.sysid
  console.log(`found system ${system}, ${STATES[message.customMode]}`)
  const found = await parameters()
  console.log(`${found.size} parameters, SPD_SLOW is ${found.get('SPD_SLOW').toFixed(2)}`)
  console.log(`SPD_SLOW set to ${(await setParameter('SPD_SLOW', 0.3)).toFixed(2)}`)
  console.log(`and back to ${(await setParameter('SPD_SLOW', found.get('SPD_SLOW'))).toFixed(2)}`)
  console.log(`armed: ${await arm(1)}`)
  try {
    const before = wheels
    const driving = state('driving')
    await drive(500, 0, 1200)
    await driving
    console.log(`drives: ${wheels.every((travel, wheel) => travel > before[wheel] + 50)}`)
    await state('ready')
    console.log('left alone, it stopped by itself')
    await drive(500, 0, 200)
    const stop = new common.DoFlightterminationCommand()
    stop.terminate = 1
    await command(stop)
    await state('stopped')
    console.log(`emergency stop; armed again: ${await arm(1)}`)
  } finally {
    console.log(`disarmed: ${await arm(0)}`)
  }
}

main()
  .catch((error) => {
    console.error(`failed: ${error.message}`)
    process.exitCode = 1
  })
  .finally(() => line.destroy())
